// The size of the noise map of Deliot and Belcour 2023.
#ifndef DELIOT_BELCOUR_NOISE_GLSL
#define DELIOT_BELCOUR_NOISE_GLSL

const uint DELIOT_BELCOUR_NOISE_SIZE = 512u; // Cells of the noise map along each axis; a power of two.

#endif
