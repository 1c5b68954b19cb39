// What values of an attribute there are.

/** The values between which nearly all lie: the 1st and the 99th percentile, so that one bright reflector darkens nothing else. */
export function middleRange(attribute, get = 'getX') {
  const values = Float64Array.from({ length: attribute.count }, (_, i) => attribute[get](i)).sort();
  const at = (share) => values[Math.floor(share * (values.length - 1))];
  const [least, greatest] = [at(0.01), at(0.99)];
  return greatest > least ? [least, greatest] : [least, least + 1];
}
