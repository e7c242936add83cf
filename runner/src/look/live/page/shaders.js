// What WebGL runs for each corner and each pixel.

/// Texels in a row of a texture that is a list.
export const ROW = 2048;

/// How much of its color has what is drawn: through a sensor shows what is inside.
const SHEER = "(fract(outline.w) > 0.25 ? 0.35 : 1.0)";

/// From a point to the outline of a shape, negative within; all in pixels. A box or a circle is quick; of any other the parts are
/// looked through, as `shapes.js` lays them out.
const DISTANCE = `
uniform highp sampler2D parts;
uniform float zoom;
vec2 texel(int i) { return texelFetch(parts, ivec2(i % ${ROW}, i / ${ROW}), 0).xy; }
float to_outline(vec2 at, vec4 outline) {
  if (outline.w < 1.0) {
    vec2 beyond = abs(at) - outline.xy;
    return length(max(beyond, 0.0)) + min(max(beyond.x, beyond.y), 0.0) - outline.z;
  }
  int next = int(outline.w);
  float nearest = 1e9;
  for (int left = int(texel(next++).x); left > 0; left--) {
    vec2 head = texel(next++);
    int count = int(head.x);
    float out_squared = 1e18, deepest = -1e9;
    for (int i = 0; i < count; i++) {
      vec2 from = texel(next + i) * zoom, edge = texel(next + (i + 1) % count) * zoom - from, away = at - from;
      float squared = dot(edge, edge);
      vec2 off = away - edge * (squared > 0.0 ? clamp(dot(away, edge) / squared, 0.0, 1.0) : 0.0);
      out_squared = min(out_squared, dot(off, off));
      if (squared > 0.0) deepest = max(deepest, (away.x * edge.y - away.y * edge.x) * inversesqrt(squared));
    }
    next += count;
    float far = count > 2 && deepest < 0.0 ? deepest : sqrt(out_squared);
    // A line is never thinner than a pixel.
    nearest = min(nearest, far - (count < 3 ? max(head.y * zoom, 0.5) : head.y * zoom));
  }
  return nearest;
}`;

export const BODY_VERTEX = `#version 300 es
precision highp float;
precision highp usampler2D;
uniform usampler2D bodies;
uniform sampler2D shapes;
uniform vec4 place;      // from fractions of the frame's rectangle to the clip square: scale, offset
uniform vec2 pixels;     // half the size of the clip square, in pixels
uniform float zoom;      // pixels in a meter
flat out vec4 outline;   // half width, half height, radius, in pixels; where its parts are, if it has some
flat out vec4 color;
out vec2 at;             // from the center, along the body's axes, in pixels
const vec2 CORNERS[6] = vec2[](vec2(-1,-1), vec2(1,-1), vec2(1,1), vec2(-1,-1), vec2(1,1), vec2(-1,1));
void main() {
  int body = gl_VertexID / 6;
  uvec3 word = texelFetch(bodies, ivec2(body % ${ROW}, body / ${ROW}), 0).xyz;
  vec2 position = vec2(word.x & 0xffffu, word.x >> 16) / 65535.0;
  float angle = float(word.y & 0xffffu) / 65536.0 * 6.283185307179586;
  int kind = int(word.y >> 16) | int(word.z >> 24) << 16;
  outline = texelFetch(shapes, ivec2(kind % ${ROW}, kind / ${ROW}), 0) * vec4(zoom, zoom, zoom, 1.0);
  bool is_plain = outline.w < 1.0;
  // A box is never thinner than a pixel.
  if (is_plain && outline.z == 0.0) outline.xy = max(outline.xy, 0.5);
  color = vec4(float(word.z & 0xffu), float((word.z >> 8) & 0xffu), float((word.z >> 16) & 0xffu), 255.0) / 255.0;
  color.a = ${SHEER};
  at = CORNERS[gl_VertexID % 6] * (outline.xy + (is_plain ? outline.z : 0.0) + 1.0);
  float c = cos(angle), s = sin(angle);
  vec2 turned = vec2(c * at.x - s * at.y, s * at.x + c * at.y);
  gl_Position = vec4(position * place.xy + place.zw + turned / pixels, 0.0, 1.0);
}`;

export const STATIC_VERTEX = `#version 300 es
precision highp float;
layout(location = 0) in vec4 middle;   // x, y from the middle of the view, in pixels; cosine, sine
layout(location = 1) in vec4 shape;    // half width, half height, radius, in pixels; where its parts are, if it has some
uniform vec2 pixels;
uniform vec3 ink;
flat out vec4 outline;
flat out vec4 color;
out vec2 at;
const vec2 CORNERS[6] = vec2[](vec2(-1,-1), vec2(1,-1), vec2(1,1), vec2(-1,-1), vec2(1,1), vec2(-1,1));
void main() {
  outline = shape;
  color = vec4(ink, 1.0) * ${SHEER};
  at = CORNERS[gl_VertexID] * (shape.xy + (shape.w < 1.0 ? shape.z : 0.0) + 1.5);
  vec2 turned = vec2(middle.z * at.x - middle.w * at.y, middle.w * at.x + middle.z * at.y);
  gl_Position = vec4((middle.xy + turned) / pixels, 0.0, 1.0);
}`;

export const STATIC_FRAGMENT = `#version 300 es
precision highp float;
flat in vec4 outline;
flat in vec4 color;
in vec2 at;
out vec4 pixel;
${DISTANCE}
void main() {
  float distance = to_outline(at, outline);
  pixel = color * clamp(0.5 - distance, 0.0, 1.0);
}`;

export const BODY_FRAGMENT = `#version 300 es
precision highp float;
flat in vec4 outline;
flat in vec4 color;
in vec2 at;
out vec4 pixel;
${DISTANCE}
void main() {
  float distance = to_outline(at, outline);
  float cover = clamp(0.5 - distance, 0.0, 1.0);
  if (cover == 0.0) discard;
  bool is_plain = outline.w < 1.0;
  float size = outline.z + (is_plain ? min(outline.x, outline.y) : 0.0);
  float rim = clamp(distance + 1.5, 0.0, 1.0) * smoothstep(3.0, 6.0, size);
  // A line from the center outwards shows how the body is turned.
  float reach = outline.z + (is_plain ? outline.x : 0.0);
  float mark = clamp(1.1 - abs(at.y), 0.0, 1.0) * step(0.0, at.x) * step(at.x, 0.7 * reach) * smoothstep(5.0, 9.0, size);
  vec3 ink = mix(color.rgb, color.rgb * 0.55, max(rim, mark));
  pixel = vec4(ink, 1.0) * (cover * mix(color.a, 1.0, rim));
}`;

export const IMAGE_VERTEX = `#version 300 es
uniform vec4 place;
out vec2 texel;
const vec2 CORNERS[6] = vec2[](vec2(0,0), vec2(1,0), vec2(1,1), vec2(0,0), vec2(1,1), vec2(0,1));
void main() {
  vec2 corner = CORNERS[gl_VertexID];
  texel = vec2(corner.x, 1.0 - corner.y);
  gl_Position = vec4(corner * place.xy + place.zw, 0.0, 1.0);
}`;

export const IMAGE_FRAGMENT = `#version 300 es
precision highp float;
uniform sampler2D image;
in vec2 texel;
out vec4 pixel;
void main() { pixel = texture(image, texel); }`;

export const LINE_VERTEX = `#version 300 es
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

export const LINE_FRAGMENT = `#version 300 es
precision highp float;
in vec4 color;
out vec4 pixel;
void main() { pixel = color; }`;
