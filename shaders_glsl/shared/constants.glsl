// Numbers that shaders and host share; the build gives them to Rust under the same names.
#ifndef CONSTANTS_GLSL
#define CONSTANTS_GLSL

const float PI = 3.14159265358979324; // Half a turn in radians.
const uint LIGHT_POINT = 0u; // A light at a point; its colour is radiant intensity.
const uint LIGHT_DIRECTIONAL = 1u; // A light at infinity; its colour is irradiance on a facing surface.
const uint LIGHT_SPOT = 2u; // A point light with a cone.
const uint TILE_SIDE = 8u; // Pixels along the side of a tile.
const uint MOST_GROUPS = 65535u; // Groups that every device runs along an axis.
const uint MAX_LIGHTS = 32u; // Lights in a frame: one bit each in the shadow mask.
const uint MATERIAL_DOUBLE_SIDED = 1u; // Seen from both sides.
const uint MATERIAL_ALPHA_MASK = 2u; // Holes where alpha is below the cutoff.
const uint MATERIAL_UNLIT = 4u; // Shows its base colour and nothing else.
const uint MATERIAL_GLINTS = 8u; // Its specular lobe is made of flakes.
const uint MATERIAL_NORMAL_MAP = 16u; // Has a texture of normals.
const uint MATERIAL_GLINT_REPEATS = 32u; // Its flakes are the same in each square of texture.
const uint MATERIAL_LAYER_SHIFT = 24u; // Where in its flags the number of its layer of glints begins.
const uint INSTANCE_MIRRORED = 1u; // Its transform changes handedness.
const uint INSTANCE_HAS_TANGENTS = 2u; // Its mesh has tangents.
const uint INSTANCE_HAS_UV = 4u; // Its mesh has texture coordinates.
const uint INSTANCE_HAS_COLORS = 8u; // Its mesh has vertex colours.
const uint TEXTURE_BASE_COLOR = 0u; // Slot of the base colour.
const uint TEXTURE_METALLIC_ROUGHNESS = 1u; // Slot of roughness (green) and metalness (blue).
const uint TEXTURE_NORMAL = 2u; // Slot of the tangent-space normal.
const uint TEXTURE_OCCLUSION = 3u; // Slot of the ambient occlusion (red).
const uint TEXTURE_EMISSIVE = 4u; // Slot of the emission.
const uint TEXTURE_CLEARCOAT = 5u; // Slot of the clear coat's weight (red).
const uint TEXTURE_CLEARCOAT_ROUGHNESS = 6u; // Slot of the clear coat's roughness (green).
const uint TEXTURE_SPECULAR_COLOR = 7u; // Slot of the dielectric reflectance's tint.
const uint TEXTURE_SPECULAR = 8u; // Slot of the weight of the dielectric lobe (alpha).
const uint TEXTURE_SLOTS = 9u; // How many slots a material has.
const uint SPECULAR_LAYERS = 8u; // Roughnesses at which the environment is prefiltered.
const uint RING_AZIMUTHS = 32u; // About a small light of the environment, of cones at its edge.
const uint RING_DISTANCES = 64u; // From it.
const uint ALBEDO_SIZE = 64u; // Cosines and roughnesses of the directional-albedo table.
const uint PREFILTER_THETA_N = 31u; // Polar angles of the normal in the prefiltered table of Wang et al. 2020.
const uint PREFILTER_PHI_N = 60u; // Azimuths of the normal.
const uint PREFILTER_THETA_O = 10u; // Polar angles of the view about the normal.
const uint PREFILTER_PHI_O = 36u; // Azimuths of the view about the normal.

#endif
