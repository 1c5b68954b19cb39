// What values of an attribute there are.

/**
 * The values between which nearly all of `count` lie: the 1st and the 99th percentile, so that one bright reflector darkens
 * nothing else. `valueOf` takes an index. What lies within `noise` counts as one value, which gets a range of 1.
 */
export function middleRange(count, valueOf, noise = 0) {
  const values = Float64Array.from({ length: count }, (_, i) => valueOf(i)).sort();
  const at = (share) => values[Math.floor(share * (values.length - 1))];
  const [least, greatest] = [at(0.01), at(0.99)];
  return greatest - least > noise ? [least, greatest] : [least, least + 1];
}
