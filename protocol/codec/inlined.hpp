#pragma once

// Inlines the bodies of kernels into plain functions and into functions for each kind of vector unit.
#if defined(__GNUC__)
#define PROBEBOX_INLINE [[gnu::always_inline]] inline
#else
#define PROBEBOX_INLINE inline
#endif
