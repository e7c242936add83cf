// Shapes as textures, and where statics are that move.

/// Shapes with parts and their parts as texels, from which the shaders read them: for each shape its size, and the place of the first
/// texel of its parts, which is 0 if it has none, and half of one more if what is inside shows through. There stands how many parts it has, then for each part how many corners it has and
/// how far it reaches around them, and its corners. `lists` are lists of shapes.
export function laid_out(lists) {
  const parts = [0, 0, 0, 0];
  const lay = ({ size, sensor, parts: of }) => {
    const sheer = sensor ? 0.5 : 0;
    if (!of) return [...size, sheer];
    const first = parts.length / 4;
    parts.push(of.length, 0, 0, 0);
    for (const [corners, radius] of of) {
      parts.push(corners.length, radius, 0, 0);
      for (const [x, y] of corners) parts.push(x, y, 0, 0);
    }
    return [...size, first + sheer];
  };
  return { shapes: lists.map((list) => list.map(lay)), parts };
}

/// Where a static is at a time, and the cosine and sine of how it is turned.
export function pose({ at: [x, y, c, s], path }, time) {
  if (!path) return [x, y, c, s];
  const { line, sine, circle, period, phase, turning } = path;
  const turn = ((time / period + phase) % 1) * 2 * Math.PI;
  const [dx, dy] = line ? line.map((speed) => speed * time)
    : sine ? sine.map((most) => most * Math.sin(turn))
      : circle !== undefined ? [circle * Math.cos(turn), circle * Math.sin(turn)] : [0, 0];
  const [turned_c, turned_s] = [Math.cos(turning * time), Math.sin(turning * time)];
  return [x + dx, y + dy, c * turned_c - s * turned_s, s * turned_c + c * turned_s];
}
