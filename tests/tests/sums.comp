// The error of a sum of two floats, by operations that must neither be contracted nor reassociated.
#version 460

layout(local_size_x = 64) in;

struct Terms {
  float a;
  float b;
  float c;
};

struct Sums {
  float sum; // a + b, rounded,
  float error; // and what was rounded off (Knuth 1969, TwoSum).
  float of_product; // a b + c, rounded twice.
};

layout(std430, binding = 30) readonly buffer Asked { Terms asked[]; };
layout(std430, binding = 31) writeonly buffer Found { Sums found[]; };

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index >= asked.length()) {
    return;
  }
  Terms terms = asked[index];
  precise float sum = terms.a + terms.b;
  precise float second = sum - terms.a;
  precise float first = sum - second;
  precise float error = (terms.a - first) + (terms.b - second);
  precise float product = terms.a * terms.b;
  precise float of_product = product + terms.c;
  found[index] = Sums(sum, error, of_product);
}
