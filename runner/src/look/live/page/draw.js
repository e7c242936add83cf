// Draws frames with WebGL2. All bodies are one call: the vertex shader fetches its body from an integer texture by
// `gl_VertexID / 6`, and each body is a square in whose pixels the fragment shader measures the distance to the outline.

const ROW = 2048;

const BODY_VERTEX = `#version 300 es
precision highp float;
precision highp usampler2D;
uniform usampler2D bodies;
uniform sampler2D shapes;
uniform vec4 place;      // from fractions of the frame's rectangle to the clip square: scale, offset
uniform vec2 pixels;     // half the size of the clip square, in pixels
uniform float zoom;      // pixels in a meter
flat out vec3 outline;   // half width, half height, radius: in pixels
flat out vec4 color;
out vec2 at;             // from the center, along the body's axes, in pixels
const vec2 CORNERS[6] = vec2[](vec2(-1,-1), vec2(1,-1), vec2(1,1), vec2(-1,-1), vec2(1,1), vec2(-1,1));
void main() {
  int body = gl_VertexID / 6;
  uvec3 word = texelFetch(bodies, ivec2(body % ${ROW}, body / ${ROW}), 0).xyz;
  vec2 position = vec2(word.x & 0xffffu, word.x >> 16) / 65535.0;
  float angle = float(word.y & 0xffffu) / 65536.0 * 6.283185307179586;
  int kind = int(word.y >> 16) | int(word.z >> 24) << 16;
  outline = texelFetch(shapes, ivec2(kind % ${ROW}, kind / ${ROW}), 0).xyz * zoom;
  color = vec4(float(word.z & 0xffu), float((word.z >> 8) & 0xffu), float((word.z >> 16) & 0xffu), 255.0) / 255.0;
  at = CORNERS[gl_VertexID % 6] * (outline.xy + outline.z + 1.0);
  float c = cos(angle), s = sin(angle);
  vec2 turned = vec2(c * at.x - s * at.y, s * at.x + c * at.y);
  gl_Position = vec4(position * place.xy + place.zw + turned / pixels, 0.0, 1.0);
}`;

const STATIC_VERTEX = `#version 300 es
precision highp float;
layout(location = 0) in vec4 middle;   // x, y from the middle of the view, in pixels; cosine, sine
layout(location = 1) in vec3 shape;    // half width, half height, radius: in pixels
uniform vec2 pixels;
uniform vec3 ink;
flat out vec3 outline;
flat out vec4 color;
out vec2 at;
const vec2 CORNERS[6] = vec2[](vec2(-1,-1), vec2(1,-1), vec2(1,1), vec2(-1,-1), vec2(1,1), vec2(-1,1));
void main() {
  outline = shape;
  color = vec4(ink, 1.0);
  at = CORNERS[gl_VertexID] * (shape.xy + shape.z + 1.0);
  vec2 turned = vec2(middle.z * at.x - middle.w * at.y, middle.w * at.x + middle.z * at.y);
  gl_Position = vec4((middle.xy + turned) / pixels, 0.0, 1.0);
}`;

const STATIC_FRAGMENT = `#version 300 es
precision highp float;
flat in vec3 outline;
flat in vec4 color;
in vec2 at;
out vec4 pixel;
void main() {
  vec2 beyond = abs(at) - outline.xy;
  float distance = length(max(beyond, 0.0)) + min(max(beyond.x, beyond.y), 0.0) - outline.z;
  pixel = color * clamp(0.5 - distance, 0.0, 1.0);
}`;

const BODY_FRAGMENT = `#version 300 es
precision highp float;
flat in vec3 outline;
flat in vec4 color;
in vec2 at;
out vec4 pixel;
void main() {
  vec2 beyond = abs(at) - outline.xy;
  float distance = length(max(beyond, 0.0)) + min(max(beyond.x, beyond.y), 0.0) - outline.z;
  float cover = clamp(0.5 - distance, 0.0, 1.0);
  if (cover == 0.0) discard;
  float size = min(outline.x, outline.y) + outline.z;
  float rim = clamp(distance + 1.5, 0.0, 1.0) * smoothstep(3.0, 6.0, size);
  // A line from the center outwards shows how the body is turned.
  float reach = outline.x + outline.z;
  float mark = clamp(1.1 - abs(at.y), 0.0, 1.0) * step(0.0, at.x) * step(at.x, 0.7 * reach) * smoothstep(5.0, 9.0, size);
  vec3 ink = mix(color.rgb, color.rgb * 0.55, max(rim, mark));
  pixel = vec4(ink, 1.0) * (cover * color.a);
}`;

const IMAGE_VERTEX = `#version 300 es
uniform vec4 place;
out vec2 texel;
const vec2 CORNERS[6] = vec2[](vec2(0,0), vec2(1,0), vec2(1,1), vec2(0,0), vec2(1,1), vec2(0,1));
void main() {
  vec2 corner = CORNERS[gl_VertexID];
  texel = vec2(corner.x, 1.0 - corner.y);
  gl_Position = vec4(corner * place.xy + place.zw, 0.0, 1.0);
}`;

const IMAGE_FRAGMENT = `#version 300 es
precision highp float;
uniform sampler2D image;
in vec2 texel;
out vec4 pixel;
void main() { pixel = texture(image, texel); }`;

const LINE_VERTEX = `#version 300 es
layout(location = 0) in vec4 ends;     // both ends of a line, in tiles
layout(location = 1) in vec4 ink;      // color, and thickness in pixels
uniform vec4 place;
uniform vec2 pixels;
uniform float fade;
out vec4 color;
const vec2 CORNERS[6] = vec2[](vec2(0,-1), vec2(1,-1), vec2(1,1), vec2(0,-1), vec2(1,1), vec2(0,1));
void main() {
  vec2 corner = CORNERS[gl_VertexID];
  vec2 a = ends.xy * place.xy + place.zw, b = ends.zw * place.xy + place.zw;
  vec2 along = normalize((b - a) * pixels);
  vec2 across = vec2(-along.y, along.x) * 0.5 * ink.a;
  gl_Position = vec4(mix(a, b, corner.x) + across * corner.y / pixels, 0.0, 1.0);
  color = vec4(ink.rgb, 1.0) * (ink.a > 1.0 ? 1.0 : fade);
}`;

const LINE_FRAGMENT = `#version 300 es
precision highp float;
in vec4 color;
out vec4 pixel;
void main() { pixel = color; }`;

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

/// What a canvas is drawn with. Lost with its context: then make another.
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

  /// What is needed for one source: `shapes` are half widths, half heights and radii, in m; `statics` are x, y, cosine, sine, and
  /// these.
  source(shapes, statics, static_color) {
    const { gl } = this;
    const rows = Math.max(1, Math.ceil(shapes.length / ROW));
    const table = new Float32Array(4 * ROW * rows);
    shapes.forEach((shape, i) => table.set(shape, 4 * i));
    const made = {
      shapes: texture(gl, gl.NEAREST), bodies: texture(gl, gl.NEAREST), density: texture(gl, gl.LINEAR),
      rows: 0, count: 0, rectangle: null, density_rectangle: null, lines: null, statics, static_color,
      fixed: { array: gl.createVertexArray(), buffer: gl.createBuffer(), values: new Float32Array(7 * statics.length) },
    };
    gl.bindVertexArray(made.fixed.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, made.fixed.buffer);
    for (const [location, size, offset] of [[0, 4, 0], [1, 3, 16]]) {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, size, gl.FLOAT, false, 28, offset);
      gl.vertexAttribDivisor(location, 1);
    }
    gl.bindVertexArray(null);
    gl.bindTexture(gl.TEXTURE_2D, made.shapes);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, ROW, rows, 0, gl.RGBA, gl.FLOAT, table);
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
    source.rectangle = frame.rectangle;
    source.density_rectangle = width * height ? rectangle : null;
  }

  /// Lines between tiles, and around what each rank holds: ranks by tile, in the order of `leaves`, or row by row from the lower left.
  grid(source, { tiles: [columns, rows], levels, rank_of_tile: ranks }, colors) {
    const { gl } = this;
    const lines = [];
    const add = (x0, y0, x1, y1, [r, g, b], thickness) => lines.push(x0, y0, x1, y1, r / 255, g / 255, b / 255, thickness);
    const gray = [128, 135, 148];
    const several = ranks.some((of) => of !== ranks[0]);
    const color = (a, b) => colors[Math.max(a, b) % colors.length];
    if (levels) {
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
    source.lines.side = levels ? Math.sqrt((columns * rows) / levels.length) : 1;
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

  /// What never moves, never thinner than a pixel.
  draw_statics({ statics, static_color, fixed }, camera, half) {
    const { gl } = this;
    let count = 0;
    const { zoom } = camera;
    for (const [x, y, c, s, half_x, half_y, radius] of statics) {
      const [px, py] = [(x - camera.x) * zoom, (y - camera.y) * zoom];
      const reach = (Math.hypot(half_x, half_y) + radius) * zoom + 2;
      if (Math.abs(px) > half[0] + reach || Math.abs(py) > half[1] + reach) continue;
      const shape = radius ? [0, 0, Math.max(1, radius * zoom)] : [Math.max(0.5, half_x * zoom), Math.max(0.5, half_y * zoom), 0];
      fixed.values.set([px, py, c, s, ...shape], 7 * count++);
    }
    if (!count) return;
    const { linked, at } = this.fixed;
    gl.useProgram(linked);
    gl.uniform2f(at.pixels, ...half);
    gl.uniform3f(at.ink, ...static_color.map((part) => part / 255));
    gl.bindVertexArray(fixed.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, fixed.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, fixed.values.subarray(0, 7 * count), gl.STREAM_DRAW);
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
