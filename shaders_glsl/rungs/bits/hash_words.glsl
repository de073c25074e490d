// Two and three words mixed into one, and two from two.
#include "shared/hash.glsl"

uvec4 answer(uvec4 a, uvec4 b) {
  return uvec4(hash(a.x, a.y), hash(a.x, a.y, a.z), tea(a.xy));
}
