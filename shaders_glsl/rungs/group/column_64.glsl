// Groups of 64 invocations above one another.
layout(local_size_y = 64) in;
