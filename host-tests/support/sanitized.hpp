#pragma once

namespace probebox::support {

// Long runs shrink under a sanitizer, ten times slower: it looks at memory, not at statistics.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace probebox::support
