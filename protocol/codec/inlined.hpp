#pragma once

// Inlines the kernel bodies into plain functions and into one function for each vector instruction set.
#if defined(__GNUC__)
#define PROBEBOX_INLINE [[gnu::always_inline]] inline
#else
#define PROBEBOX_INLINE inline
#endif
