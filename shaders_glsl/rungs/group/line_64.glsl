// Groups of 64 invocations.
layout(local_size_x = 64) in;
