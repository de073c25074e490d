// What `shared/flake_set.glsl` makes of keys and words.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/flake_set.glsl"

layout(local_size_x = 64) in;

struct Word {
  uint a;
  uint b;
  uint c;
  uint d;
};

struct Made {
  uint key[2]; // Of the node at level a & 31, (b, c), with seed d.
  uint pair[2]; // The normal pair of a and b, as bits.
  uint drawn; // Word a of the key (b, c).
  uint half_low[2]; // How many of (c and d's bits, cut to 2^40) fall into the lower half, by words a and b.
  uint children[8]; // Of the same number, by the key (a, b).
  uint place[2]; // Of flake a in leaf (b, c).
  uint normal[2]; // Of flake a in leaf (b, c), slopes of deviation .3, as bits.
};

layout(std430, binding = 30) readonly buffer Words { Word words[]; };
layout(std430, binding = 31) writeonly buffer Mades { Made mades[]; };

uint[2] split(uint64_t number) {
  return uint[](uint(number & 0xffffffffUL), uint(number >> 32));
}

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index >= words.length()) {
    return;
  }
  Word word = words[index];
  Made made;
  uvec2 key = node_key(word.a & 31u, word.b, word.c, word.d);
  made.key = uint[](key.x, key.y);
  vec2 pair = normal_pair(word.a, word.b);
  made.pair = uint[](floatBitsToUint(pair.x), floatBitsToUint(pair.y));
  made.drawn = draw(uvec2(word.b, word.c), word.a);
  // Numbers of every size: the shift takes off 0 to 39 bits.
  uint64_t number = (uint64_t(word.c) | uint64_t(word.d & 0xffu) << 32) >> (word.d >> 8) % 40u;
  made.half_low = split(half_of(number, word.a, word.b));
  u64vec4 children = children_of(number, uvec2(word.a, word.b));
  for (uint child = 0u; child < 4u; ++child) {
    uint[2] parts = split(children[child]);
    made.children[2u * child] = parts[0];
    made.children[2u * child + 1u] = parts[1];
  }
  uvec2 place = flake_place(uvec2(word.b, word.c), word.a);
  made.place = uint[](place.x, place.y);
  vec3 normal = flake_normal(uvec2(word.b, word.c), word.a, 0.3);
  made.normal = uint[](floatBitsToUint(normal.x), floatBitsToUint(normal.y));
  mades[index] = made;
}
