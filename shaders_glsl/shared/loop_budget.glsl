// How long loops may be.
#ifndef LOOP_BUDGET_GLSL
#define LOOP_BUDGET_GLSL

// Steps that an invocation takes at most. Lavapipe ends the loops of eight invocations, which run as one vector, without
// a word when they have gone round 65,535 times between them; eight of these are less than 60,000.
const int STEPS_A_INVOCATION = 7000;

#endif
