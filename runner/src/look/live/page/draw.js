// Draws frames with WebGL2. All bodies are one call: the vertex shader fetches its body from an integer texture by
// `gl_VertexID / 6`, and each body is a square in whose pixels the fragment shader measures the distance to the outline.

import { BODY_FRAGMENT, BODY_VERTEX, IMAGE_FRAGMENT, IMAGE_VERTEX, LINE_FRAGMENT, LINE_VERTEX, ROW, STATIC_FRAGMENT, STATIC_VERTEX } from "./shaders.js";
import { laid_out, pose } from "./shapes.js";

function program(gl, vertex, fragment) {
  const linked = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(linked, shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
      throw new Error(gl.getShaderInfoLog(shader));
    }
  }
  gl.linkProgram(linked);
  const names = Array.from({ length: gl.getProgramParameter(linked, gl.ACTIVE_UNIFORMS) || 0 },
    (_, i) => gl.getActiveUniform(linked, i).name);
  return { linked, at: Object.fromEntries(names.map((name) => [name, gl.getUniformLocation(linked, name)])) };
}

function texture(gl, filter) {
  const made = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, made);
  for (const [key, value] of [
    [gl.TEXTURE_MIN_FILTER, filter], [gl.TEXTURE_MAG_FILTER, filter],
    [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE],
  ]) {
    gl.texParameteri(gl.TEXTURE_2D, key, value);
  }
  return made;
}

/// Tiles that were cut from columns x rows of squares, `levels` giving how often each was, a letter for each: the corner and the
/// side of each in squares, and `find_at`, which tells the tile at a place, or -1.
function leaves(columns, rows, levels) {
  const all = [];
  const grow = (x, y, side, level) => {
    if (levels.charCodeAt(all.length) - 97 <= level) {
      all.push({ x, y, side, level });
      return all.length - 1;
    }
    const half = side / 2;
    return [[x, y], [x + half, y], [x, y + half], [x + half, y + half]].map(([x, y]) => grow(x, y, half, level + 1));
  };
  const roots = [];
  for (let i = 0; i < columns * rows; i++) roots.push(grow(i % columns, Math.floor(i / columns), 1, 0));
  all.find_at = (x, y) => {
    if (x < 0 || y < 0 || x >= columns || y >= rows) return -1;
    let node = roots[Math.floor(y) * columns + Math.floor(x)];
    for (let [low_x, low_y, side] = [Math.floor(x), Math.floor(y), 0.5]; Array.isArray(node); side /= 2) {
      const [right, upper] = [x >= low_x + side, y >= low_y + side];
      [low_x, low_y] = [low_x + side * right, low_y + side * upper];
      node = node[right + 2 * upper];
    }
    return node;
  };
  return all;
}

/// What a canvas is drawn with. Lost with its context: then make another.
export class Drawing {
  constructor(canvas) {
    this.gl = canvas.getContext("webgl2", { antialias: false, alpha: false });
    if (!this.gl) throw new Error("this browser has no WebGL2");
    const gl = this.gl;
    this.body = program(gl, BODY_VERTEX, BODY_FRAGMENT);
    this.fixed = program(gl, STATIC_VERTEX, STATIC_FRAGMENT);
    this.image = program(gl, IMAGE_VERTEX, IMAGE_FRAGMENT);
    this.line = program(gl, LINE_VERTEX, LINE_FRAGMENT);
    this.nothing = gl.createVertexArray();
    gl.disable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    // Colors come multiplied by what they cover.
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  }

  /// What is needed for one source: the shapes of bodies, those of statics, and the statics.
  source({ shapes, static_shapes, statics }, static_color) {
    const { gl } = this;
    const laid = laid_out([shapes, static_shapes]);
    const list = (numbers) => {
      const rows = Math.max(1, Math.ceil(numbers.length / 4 / ROW));
      const table = new Float32Array(4 * ROW * rows);
      table.set(numbers);
      const made = texture(gl, gl.NEAREST);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, ROW, rows, 0, gl.RGBA, gl.FLOAT, table);
      return made;
    };
    const made = {
      shapes: list(laid.shapes[0].flat()), parts: list(laid.parts), bodies: texture(gl, gl.NEAREST),
      density: texture(gl, gl.LINEAR), rows: 0, count: 0, time: 0, rectangle: null, density_rectangle: null, lines: null,
      statics, static_shapes: laid.shapes[1], static_color,
      fixed: { array: gl.createVertexArray(), buffer: gl.createBuffer(), values: new Float32Array(8 * statics.length) },
    };
    gl.bindVertexArray(made.fixed.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, made.fixed.buffer);
    for (const location of [0, 1]) {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, 4, gl.FLOAT, false, 32, 16 * location);
      gl.vertexAttribDivisor(location, 1);
    }
    gl.bindVertexArray(null);
    return made;
  }

  /// Brings a frame to where it is drawn from.
  load(source, frame) {
    const { gl } = this;
    const { count, words } = frame.bodies;
    const rows = Math.ceil(count / ROW);
    gl.bindTexture(gl.TEXTURE_2D, source.bodies);
    if (rows > source.rows) {
      source.rows = rows + (rows >> 2);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB32UI, ROW, source.rows, 0, gl.RGB_INTEGER, gl.UNSIGNED_INT, null);
    }
    const whole = Math.floor(count / ROW), rest = count % ROW;
    const part = (y, width, height) =>
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, y, width, height, gl.RGB_INTEGER, gl.UNSIGNED_INT, words, 3 * ROW * y);
    if (whole) part(0, ROW, whole);
    if (rest) part(whole, rest, 1);
    const { width, height, rectangle, pixels } = frame.density;
    if (width * height) {
      gl.bindTexture(gl.TEXTURE_2D, source.density);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, width, height, 0, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    }
    source.count = count;
    source.time = frame.time;
    source.rectangle = frame.rectangle;
    source.density_rectangle = width * height ? rectangle : null;
  }

  /// Lines between tiles, and around what each rank holds: ranks by tile, in the order of `leaves`, or row by row from the lower left.
  grid(source, { tiles: [columns, rows], levels, corners, rank_of_tile: ranks }, colors) {
    const { gl } = this;
    const lines = [];
    const add = (x0, y0, x1, y1, [r, g, b], thickness) => lines.push(x0, y0, x1, y1, r / 255, g / 255, b / 255, thickness);
    const gray = [128, 135, 148];
    const several = ranks.some((of) => of !== ranks[0]);
    const color = (a, b) => colors[Math.max(a, b) % colors.length];
    if (corners) {
      const scale = ([x0, y0, x1, y1]) => [x0 * columns, y0 * rows, x1 * columns, y1 * rows];
      const all = corners.map(scale);
      add(0, 0, columns, 0, gray, 1);
      add(0, 0, 0, rows, gray, 1);
      for (const [x0, y0, x1, y1] of all) {
        add(x1, y0, x1, y1, gray, 1);
        add(x0, y1, x1, y1, gray, 1);
      }
      // Along the part of an edge that two tiles share.
      for (const [i, [x0, y0, x1, y1]] of several ? all.entries() : []) {
        for (const [j, [low_x, low_y, high_x, high_y]] of all.entries()) {
          if (ranks[i] === ranks[j]) continue;
          const [from_x, to_x] = [Math.max(x0, low_x), Math.min(x1, high_x)];
          const [from_y, to_y] = [Math.max(y0, low_y), Math.min(y1, high_y)];
          const between = color(ranks[i], ranks[j]);
          if (x1 === low_x && from_y < to_y) add(x1, from_y, x1, to_y, between, 3);
          if (y1 === low_y && from_x < to_x) add(from_x, y1, to_x, y1, between, 3);
        }
      }
    } else if (levels) {
      const all = leaves(columns, rows, levels);
      add(0, 0, columns, 0, gray, 1);
      add(0, 0, 0, rows, gray, 1);
      for (const { x, y, side } of all) {
        add(x + side, y, x + side, y + side, gray, 1);
        add(x, y + side, x + side, y + side, gray, 1);
      }
      // Between two tiles the smaller one draws the line; of two that are alike, the one that lies right or above.
      const rank = (tile) => (tile < 0 ? -1 : ranks[tile] ?? -1);
      for (const [i, { x, y, side, level }] of several ? all.entries() : []) {
        const end = side * 1.25, middle = side / 2;
        const sides = [
          [x - side / 4, y + middle, [x, y, x, y + side], false],
          [x + middle, y - side / 4, [x, y, x + side, y], false],
          [x + end, y + middle, [x + side, y, x + side, y + side], true],
          [x + middle, y + end, [x, y + side, x + side, y + side], true],
        ];
        for (const [at_x, at_y, line, is_far] of sides) {
          const other = all.find_at(at_x, at_y);
          const draws = other < 0 || all[other].level < level || (all[other].level === level && !is_far);
          if (draws && rank(other) !== rank(i)) add(...line, color(rank(i), rank(other)), 3);
        }
      }
    } else {
      for (let i = 0; i <= columns; i++) add(i, 0, i, rows, gray, 1);
      for (let i = 0; i <= rows; i++) add(0, i, columns, i, gray, 1);
      const rank = (x, y) => (x < 0 || y < 0 || x >= columns || y >= rows ? -1 : ranks[y * columns + x] ?? -1);
      for (let y = 0; y <= rows && several; y++) {
        for (let x = 0; x <= columns; x++) {
          const here = rank(x, y), left = rank(x - 1, y), below = rank(x, y - 1);
          if (here !== left && y < rows) add(x, y, x, y + 1, color(here, left), 3);
          if (here !== below && x < columns) add(x, y, x + 1, y, color(here, below), 3);
        }
      }
    }
    source.lines ??= { array: gl.createVertexArray(), buffer: gl.createBuffer() };
    source.lines.count = lines.length / 8;
    source.lines.tiles = [columns, rows];
    // How wide a tile is, on the average.
    source.lines.side = corners ? Math.sqrt(columns) : levels ? Math.sqrt((columns * rows) / levels.length) : 1;
    gl.bindVertexArray(source.lines.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, source.lines.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(lines), gl.STATIC_DRAW);
    for (const location of [0, 1]) {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, 4, gl.FLOAT, false, 32, 16 * location);
      gl.vertexAttribDivisor(location, 1);
    }
    gl.bindVertexArray(null);
  }

  clear([r, g, b]) {
    const { gl } = this;
    gl.disable(gl.SCISSOR_TEST);
    gl.clearColor(r, g, b, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
  }

  /// Draws a source into `box` (x, y from below, width, height in pixels), as `camera` sees it.
  draw(source, box, camera, domain, with_grid) {
    const { gl } = this;
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(...box);
    gl.viewport(...box);
    const half = [box[2] / 2, box[3] / 2];
    // In double precision here, so that the shaders never see large coordinates.
    const place = ([x0, y0, x1, y1], [across, up]) => [
      ((x1 - x0) / across) * camera.zoom / half[0], ((y1 - y0) / up) * camera.zoom / half[1],
      (x0 - camera.x) * camera.zoom / half[0], (y0 - camera.y) * camera.zoom / half[1],
    ];
    const use = ({ linked, at }, rectangle, units = [1, 1]) => {
      gl.useProgram(linked);
      gl.uniform4f(at.place, ...place(rectangle, units));
      if (at.pixels) gl.uniform2f(at.pixels, ...half);
      return at;
    };
    this.draw_statics(source, camera, half);
    gl.bindVertexArray(this.nothing);
    if (source.density_rectangle) {
      use(this.image, source.density_rectangle);
      gl.bindTexture(gl.TEXTURE_2D, source.density);
      gl.drawArrays(gl.TRIANGLES, 0, 6);
    }
    if (source.count) {
      const at = use(this.body, source.rectangle);
      gl.uniform1f(at.zoom, camera.zoom);
      gl.uniform1i(at.bodies, 0);
      gl.uniform1i(at.shapes, 1);
      gl.uniform1i(at.parts, 2);
      gl.activeTexture(gl.TEXTURE2);
      gl.bindTexture(gl.TEXTURE_2D, source.parts);
      gl.activeTexture(gl.TEXTURE1);
      gl.bindTexture(gl.TEXTURE_2D, source.shapes);
      gl.activeTexture(gl.TEXTURE0);
      gl.bindTexture(gl.TEXTURE_2D, source.bodies);
      gl.drawArrays(gl.TRIANGLES, 0, 6 * source.count);
    }
    if (with_grid && source.lines) {
      const at = use(this.line, domain, source.lines.tiles);
      const tile = ((domain[2] - domain[0]) / source.lines.tiles[0]) * source.lines.side * camera.zoom;
      gl.uniform1f(at.fade, Math.min(1, Math.max(0, (tile - 4) / 24)) * 0.6);
      gl.bindVertexArray(source.lines.array);
      gl.drawArraysInstanced(gl.TRIANGLES, 0, 6, source.lines.count);
      gl.bindVertexArray(null);
    }
  }

  /// Statics where they are at the time of the frame, never thinner than a pixel.
  draw_statics({ statics, static_shapes, static_color, fixed, parts, time }, camera, half) {
    const { gl } = this;
    let count = 0;
    const { zoom } = camera;
    for (const body of statics) {
      const [x, y, c, s] = pose(body, time);
      const [half_x, half_y, radius, first] = static_shapes[body.shape];
      const [px, py] = [(x - camera.x) * zoom, (y - camera.y) * zoom];
      const reach = (Math.hypot(half_x, half_y) + radius) * zoom + 2;
      if (Math.abs(px) > half[0] + reach || Math.abs(py) > half[1] + reach) continue;
      const has_parts = first >= 1;
      const least = has_parts || radius ? 0 : 0.5;
      const round = has_parts ? radius * zoom : radius && Math.max(1, radius * zoom);
      fixed.values.set([px, py, c, s, Math.max(least, half_x * zoom), Math.max(least, half_y * zoom), round, first], 8 * count++);
    }
    if (!count) return;
    const { linked, at } = this.fixed;
    gl.useProgram(linked);
    gl.uniform2f(at.pixels, ...half);
    gl.uniform3f(at.ink, ...static_color.map((part) => part / 255));
    gl.uniform1f(at.zoom, zoom);
    gl.uniform1i(at.parts, 2);
    gl.activeTexture(gl.TEXTURE2);
    gl.bindTexture(gl.TEXTURE_2D, parts);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindVertexArray(fixed.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, fixed.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, fixed.values.subarray(0, 8 * count), gl.STREAM_DRAW);
    gl.drawArraysInstanced(gl.TRIANGLES, 0, 6, count);
  }

  /// How many pixels of a box are not of a color.
  count([x, y, width, height], [r, g, b]) {
    const { gl } = this;
    const pixels = new Uint8Array(4 * width * height);
    gl.readPixels(x, y, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    let others = 0;
    for (let i = 0; i < pixels.length; i += 4) {
      const off = Math.abs(pixels[i] - 255 * r) + Math.abs(pixels[i + 1] - 255 * g) + Math.abs(pixels[i + 2] - 255 * b);
      others += off > 24;
    }
    return others;
  }
}
