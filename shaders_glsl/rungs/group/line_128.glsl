// Groups of 128 invocations.
layout(local_size_x = 128) in;
