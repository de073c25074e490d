// Groups of 33 invocations, which no size of subgroups divides.
layout(local_size_x = 33) in;
