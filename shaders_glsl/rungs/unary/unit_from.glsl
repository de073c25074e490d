// The number inside (0, 1) of a word.
#include "shared/hash.glsl"

float helper(uint word) {
  return unit_from(word);
}
