// Groups of 8 x 8 invocations, as passes over pictures have them.
layout(local_size_x = 8, local_size_y = 8) in;
