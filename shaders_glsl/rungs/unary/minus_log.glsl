// -ln of a word over 2^32.
#include "shared/flake_set.glsl"

float helper(uint word) {
  return minus_log(word);
}
