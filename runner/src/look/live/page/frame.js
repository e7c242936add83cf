// Frames as the server sends them: see protocol.rs, which says how they lie. Numbers are little-endian, as on every machine
// that browsers run on.

const MAGIC = 0x4c4f5441;
const HEADER = 120;

/// Bytes of a body.
export const BODY = 12;

/// Reads a frame; positions stay as they are, fractions of `rectangle`.
export function decode(buffer) {
  const view = new DataView(buffer);
  if (buffer.byteLength < HEADER || view.getUint32(0, true) !== MAGIC) {
    throw new Error("not a frame");
  }
  const doubles = (at, count) => Array.from({ length: count }, (_, i) => view.getFloat64(at + 8 * i, true));
  const [width, height] = [view.getUint32(56, true), view.getUint32(60, true)];
  const [bodies, words] = [view.getUint32(112, true), view.getUint32(116, true)];
  const pixels = HEADER + words;
  const records = pixels + 4 * width * height;
  if (buffer.byteLength !== records + BODY * bodies) {
    throw new Error(`a frame of ${bodies} bodies has ${buffer.byteLength} bytes`);
  }
  const followed = doubles(96, 2);
  return {
    source: view.getUint32(4, true),
    number: view.getUint32(8, true),
    step: view.getUint32(12, true),
    time: view.getFloat64(16, true),
    rectangle: doubles(24, 4),
    density: { width, height, rectangle: doubles(64, 4), pixels: new Uint8Array(buffer, pixels, 4 * width * height) },
    followed: followed.every(Number.isFinite) ? followed : null,
    legend: JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, HEADER, words))),
    bodies: { count: bodies, words: new Uint32Array(buffer, records, (BODY / 4) * bodies) },
  };
}
