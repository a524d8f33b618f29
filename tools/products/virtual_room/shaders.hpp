// Shaders for OpenGL 3.3. They compute light in linear colours and write it with a gamma of 2, which needs
// only a square root, because software OpenGL is slow at pow.
#pragma once

namespace room::shaders {

inline constexpr const char* body_vertex = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
uniform mat4 model, camera;
uniform mat3 normals;
out vec3 world, facing;
void main() {
  vec4 placed = model * vec4(position, 1.0);
  world = placed.xyz;
  facing = normals * normal;
  gl_Position = camera * placed;
}
)";

// Fragment shader of all bodies. `look` selects the body: 0 lit by a lamp, 1 the floor with its grid, lit
// too, 2 glowing.
inline constexpr const char* body_fragment = R"(#version 330 core
in vec3 world, facing;
uniform int look;
uniform vec3 colour, eye, sun;       // sun: unit, towards the light
uniform float alpha, gloss;
uniform mat4 to_room;                // world to the room's axes
out vec4 result;

// Share of the pixel covered by a line of this width (m) every `step` metres.
float grid_line(float x, float every, float width) {
  float pixel = fwidth(x);
  float away = abs(fract(x / every - 0.5) - 0.5) * every;
  return clamp((0.5 * width + 0.5 * pixel - away) / max(pixel, 1e-6), 0.0, 1.0) * min(1.0, width / max(pixel, 1e-6));
}
vec3 floor_colour(vec2 p) {
  vec3 c = colour;
  float fine = max(grid_line(p.x, 0.01, 0.0004), grid_line(p.y, 0.01, 0.0004));
  float coarse = max(grid_line(p.x, 0.05, 0.0007), grid_line(p.y, 0.05, 0.0007));
  c = mix(c, vec3(0.07, 0.09, 0.12), 0.30 * fine);
  c = mix(c, vec3(0.09, 0.11, 0.15), 0.75 * coarse);
  return c;
}

void main() {
  vec3 n = normalize(facing), towards = normalize(eye - world);
  if (look == 2) {
    float edge = 0.72 + 0.28 * max(dot(n, towards), 0.0);
    result = vec4(sqrt(colour * edge), alpha);
    return;
  }
  vec3 base = look == 1 ? floor_colour((to_room * vec4(world, 1.0)).xy) : colour;
  vec3 light = vec3(0.32, 0.33, 0.35) + max(dot(n, sun), 0.0) * vec3(0.92, 0.86, 0.78);
  float shine = gloss * pow(max(dot(n, normalize(sun + towards)), 0.0), 48.0);
  vec3 c = base * light + shine;
  c = c / (1.0 + 0.18 * max(max(c.r, c.g), c.b));
  result = vec4(sqrt(c), alpha);
}
)";

// Vertex shader of the hairs in the magnifying glass, which stand on the floor and lean by their deflection.
// Lengths are in hair lengths.
inline constexpr const char* hair_vertex = R"(#version 330 core
layout(location = 0) in vec3 position;   // a rod along z from 0 to 1
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 place;      // root x, y; deflection x, y
layout(location = 3) in vec2 state;      // colour, 0 to 1; flash
layout(location = 4) in vec3 shape;      // half thickness in x and y; colour by age, 0 to 1
uniform mat4 camera;
uniform int by_age;
out vec3 facing, at;
out float bent, flash, along;
void main() {
  float s = position.z, lean = s * s * (1.5 - 0.5 * s);  // a cantilever under a load at its tip
  vec2 centre = place.xy + lean * place.zw;
  // A hair tapers; a sheet, which has no flash, hardly.
  float taper = (1.0 - (shape.y > 0.1 ? 0.1 : 0.45) * s) * (1.0 + 0.3 * state.y);
  at = vec3(centre + taper * shape.xy * position.xy, s);
  facing = normalize(vec3(normal.xy, 0.0) - 0.5 * vec3(0.0, 0.0, dot(normal.xy, place.zw)));
  bent = by_age != 0 ? shape.z : state.x;
  flash = state.y;
  along = s;
  gl_Position = camera * vec4(at, 1.0);
}
)";

// Fragment shader of the magnifying glass, cut to a circle. `look` selects what is drawn: 0 hair, 1 floor, 2
// underside of the block, 3 background.
inline constexpr const char* glass_fragment = R"(#version 330 core
in vec3 facing, at;
in float bent, flash, along;
uniform int look;
uniform vec3 circle;                     // centre and radius, pixels from below left
uniform vec3 sun;
uniform float reach;                     // of the floor, hairs
uniform int by_age;
out vec4 result;
vec3 by_years(float r) {
  vec3 young = vec3(0.93, 0.82, 0.25), middle = vec3(0.16, 0.50, 0.42), old = vec3(0.16, 0.08, 0.42);
  return r < 0.5 ? mix(young, middle, 2.0 * r) : mix(middle, old, 2.0 * r - 1.0);
}
vec3 by_bending(float r) {
  vec3 rest = vec3(0.16, 0.42, 0.66), low = vec3(0.10, 0.66, 0.60), mid = vec3(0.93, 0.74, 0.20), high = vec3(0.90, 0.20, 0.10);
  r = clamp(r, 0.0, 1.0);
  if (r < 0.4) return mix(rest, low, r / 0.4);
  if (r < 0.75) return mix(low, mid, (r - 0.4) / 0.35);
  return mix(mid, high, (r - 0.75) / 0.25);
}
void main() {
  if (distance(gl_FragCoord.xy, circle.xy) > circle.z) discard;
  vec3 c;
  float a = 1.0;
  if (look == 0) {
    float light = 0.42 + 0.58 * max(dot(normalize(facing), sun), 0.0);
    c = (by_age != 0 ? by_years(clamp(bent, 0.0, 1.0)) : by_bending(bent)) * light * (0.35 + 0.65 * smoothstep(0.0, 0.5, along));
    c = mix(c, vec3(1.0, 0.97, 0.88), flash);
  } else if (look == 1) {
    float fade = smoothstep(reach, 0.55 * reach, length(at.xy));
    c = mix(vec3(0.035, 0.042, 0.055), vec3(0.14, 0.155, 0.18), fade);
  } else if (look == 2) {
    c = mix(vec3(0.60, 0.335, 0.135), vec3(0.36, 0.17, 0.06), 0.5 + 0.5 * sin(19.0 * at.y));
    a = 0.55 * smoothstep(reach, 0.85 * reach, length(at.xy));
  } else {
    c = mix(vec3(0.012, 0.015, 0.02), vec3(0.045, 0.055, 0.075), 0.5 + 0.5 * at.y / reach);
  }
  result = vec4(sqrt(c), a);
}
)";

inline constexpr const char* glass_plane_vertex = R"(#version 330 core
layout(location = 0) in vec3 position;
uniform mat4 camera;
uniform float reach, height;
out vec3 facing, at;
out float bent, flash, along;
void main() {
  at = vec3(reach * position.xy, height);
  facing = vec3(0.0, 0.0, 1.0);
  bent = flash = along = 0.0;
  gl_Position = camera * vec4(at, 1.0);
}
)";

}  // namespace room::shaders
