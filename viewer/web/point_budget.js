// Which screen-space error keeps what is drawn within the point budget: the tree is refined where its error on the
// screen is largest, as long as points are left. All that it takes stands in the tilesets, so no tile is loaded in vain.
import { Box3, Frustum, Matrix4, Vector3 } from 'three';
import { TilesRenderer } from '3d-tiles-renderer/three';

/** A heap of [key, item], the greatest key first. */
class Heap {
  #items = [];
  get size() {
    return this.#items.length;
  }
  push(key, item) {
    const items = this.#items;
    let at = items.push([key, item]) - 1;
    for (let up; at > 0 && items[(up = (at - 1) >> 1)][0] < items[at][0]; at = up)
      [items[at], items[up]] = [items[up], items[at]];
  }
  pop() {
    const items = this.#items;
    const top = items[0];
    const last = items.pop();
    if (items.length === 0) return top;
    items[0] = last;
    for (let at = 0; ;) {
      let down = 2 * at + 1;
      if (down >= items.length) return top;
      if (down + 1 < items.length && items[down + 1][0] > items[down][0]) ++down;
      if (items[down][0] <= items[at][0]) return top;
      [items[at], items[down]] = [items[down], items[at]];
      at = down;
    }
  }
}

/** What a tile's metadata tells: level, points, bound, rms, spacing. */
export const factsOf = (tile) => tile.metadata.properties;

/** A camera as it looks at the frame of the tiles, in which all boxes lie along the axes. */
export class TileView {
  #frustum = new Frustum();
  #eye = new Vector3();
  #box = new Box3();
  #pixelsAtOne;
  #nearest;

  /** `toScene` takes the frame of the tiles to the scene. */
  constructor(camera, toScene, pixelsAtOne) {
    const clip = new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse).multiply(toScene);
    this.#frustum.setFromProjectionMatrix(clip);
    this.#eye.setFromMatrixPosition(camera.matrixWorld).applyMatrix4(toScene.clone().invert());
    this.#pixelsAtOne = pixelsAtOne;
    this.#nearest = camera.near;
  }
  #place(tile) {
    const b = tile.boundingVolume.box;
    this.#box.min.set(b[0] - b[3], b[1] - b[7], b[2] - b[11]);
    this.#box.max.set(b[0] + b[3], b[1] + b[7], b[2] + b[11]);
    return this.#box;
  }
  sees(tile) {
    return this.#frustum.intersectsBox(this.#place(tile));
  }
  /** Pixels of a length in the tile, where what is seen of it is nearest. */
  pixels(tile, length) {
    return Math.min((length * this.#pixelsAtOne) / this.#place(tile).distanceToPoint(this.#eye), this.mostPixels(length));
  }
  /** Pixels of a length as near as anything is seen. */
  mostPixels(length) {
    return (length * this.#pixelsAtOne) / this.#nearest;
  }
}

/** Inside a tile's box its error is not infinite, but that of what is as near as anything is seen: so the budget holds there. */
export class BudgetedTiles extends TilesRenderer {
  view = null; // a TileView

  calculateTileViewError(tile, target) {
    super.calculateTileViewError(tile, target);
    if (this.view) target.error = Math.min(target.error, this.view.mostPixels(tile.geometricError));
  }
}

/** Beyond external tilesets that are loaded: the tile that has the points, or the reference if they are not. */
const resolved = (tile) => {
  while (tile.content?.uri.endsWith('.json') && tile.children?.length === 1) tile = tile.children[0];
  return tile;
};

/** The least error, at least `target`, at which what `view` sees of the tree has at most `budget` points. */
export function errorWithinBudget(root, view, budget, target) {
  const heap = new Heap();
  const add = (tile) => heap.push(view.pixels(tile, tile.geometricError), tile);
  let points = factsOf(root).points;
  if (!view.sees(root)) return target;
  add(resolved(root));
  while (heap.size > 0) {
    const [error, tile] = heap.pop();
    if (error <= target) return target;
    const finer = (tile.children ?? []).map(resolved).filter((child) => view.sees(child));
    if (finer.length === 0) continue;
    const more = finer.reduce((sum, child) => sum + factsOf(child).points, -factsOf(tile).points);
    // A little above, so that this very tile is not refined.
    if (points + more > budget) return error * 1.0001;
    points += more;
    finer.forEach(add);
  }
  return target;
}
