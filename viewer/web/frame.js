// How the frame of the tiles stands in the scene, where y is up and the middle of the tileset is near the origin.
import { Matrix4, Vector3 } from 'three';

/** East, north and up at a point of an ellipsoid of the Earth's shape, as the columns of a rotation. */
function eastNorthUp(place) {
  const SQUARED_AXES_RATIO = 0.993305620009859; // (1 - flattening)^2 of WGS84
  const up = new Vector3(place.x, place.y, place.z / SQUARED_AXES_RATIO).normalize();
  const east = new Vector3(-up.y, up.x, 0);
  if (east.lengthSq() === 0) east.set(0, 1, 0); // at a pole
  east.normalize();
  return new Matrix4().makeBasis(east, new Vector3().crossVectors(up, east), up);
}

/**
 * Of a root tile: `fromEarth` takes what its transform leads to back to the frame of the tiles, `toScene` that frame to the
 * scene; `center` and `radius` of its box in the scene. A transform that only moves leads to tiles along the axes of the
 * Earth, which are turned so that up is up; others turn them already.
 */
export function frameOf(root) {
  const transform = root.transform ? new Matrix4().fromArray(root.transform) : new Matrix4();
  const place = new Vector3().setFromMatrixPosition(transform);
  const moved = transform.clone().setPosition(0, 0, 0);
  const toScene = new Matrix4().makeRotationX(-Math.PI / 2);
  if (place.length() > 1e6 && moved.equals(new Matrix4())) toScene.multiply(eastNorthUp(place).transpose());
  const box = root.boundingVolume.box;
  return {
    fromEarth: transform.clone().invert(),
    toScene,
    center: new Vector3(box[0], box[1], box[2]).applyMatrix4(toScene),
    radius: Math.hypot(box[3], box[7], box[11]),
  };
}
