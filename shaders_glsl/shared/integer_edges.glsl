// Operations on integers at their edges, where the language leaves the result to the device.
#ifndef INTEGER_EDGES_GLSL
#define INTEGER_EDGES_GLSL

// The lowest `count` bits set, all of them from 32 on.
uint low_bits(uint count) {
  return count >= 32u ? 0xffffffffu : (1u << (count & 31u)) - 1u;
}

// x 2^count modulo 2^32 for every count; GLSL has no shift by 32 or more.
uint shifted_left(uint x, uint count) {
  return count >= 32u ? 0u : x << (count & 31u);
}

// floor(x / 2^count) for every count.
uint shifted_right(uint x, uint count) {
  return count >= 32u ? 0u : x >> (count & 31u);
}

// x / y rounded down, 0 where y is 0.
uint quotient(uint x, uint y) {
  return y == 0u ? 0u : x / max(y, 1u);
}

// x towards 0 as an integer, the nearest one within -2^31 .. 2^31 - 128; NaN is 0. The conversion itself has no result outside.
int integer_from(float x) {
  bool is_number = (floatBitsToUint(x) & 0x7fffffffu) <= 0x7f800000u;
  return int(clamp(is_number ? x : 0.0, -2147483648.0, 2147483520.0));
}

// x towards 0 as an integer, the nearest one within 0 .. 2^32 - 256; NaN is 0.
uint whole_from(float x) {
  bool is_number = (floatBitsToUint(x) & 0x7fffffffu) <= 0x7f800000u;
  return uint(clamp(is_number ? x : 0.0, 0.0, 4294967040.0));
}

#endif
