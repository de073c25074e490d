// Groups of 32 invocations.
layout(local_size_x = 32) in;
