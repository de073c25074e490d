// How far a frame about a.xyz is from orthonormal, its side by sign(z), which is 0 at the equator.

float value(vec4 a, vec4 b, vec4 c) {
  vec3 normal = a.xyz;
  float side = sign(normal.z);
  float d = -1.0 / (side + normal.z);
  float e = normal.x * normal.y * d;
  mat3 from_local = mat3(
    vec3(1.0 + side * normal.x * normal.x * d, side * e, -side * normal.x),
    vec3(e, side + normal.y * normal.y * d, -normal.y),
    normal
  );
  mat3 error = transpose(from_local) * from_local - mat3(1.0);
  return max(length(error[0]), max(length(error[1]), length(error[2])));
}
