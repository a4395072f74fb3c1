#pragma once

// The bodies of kernels are inlined into plain functions and into functions for processors with vectors of several
// kinds, and compiled for each.
#if defined(__GNUC__)
#define PROBEBOX_INLINE [[gnu::always_inline]] inline
#else
#define PROBEBOX_INLINE inline
#endif
