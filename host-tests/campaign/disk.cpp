#include "host-tests/campaign/disk.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <system_error>
#include <unistd.h>

namespace probebox::campaign {

void setDiskFull(bool full) {
  rlimit limit{};
  ::getrlimit(RLIMIT_FSIZE, &limit);
  limit.rlim_cur = full ? 0 : limit.rlim_max;
  ::setrlimit(RLIMIT_FSIZE, &limit);
}

void spoil(const std::filesystem::path& file, std::uint64_t bit) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  if (error || size == 0) return;
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CLOEXEC);
  char byte = 0;
  const auto at = static_cast<off_t>(bit / 8 % size);
  if (::pread(descriptor, &byte, 1, at) == 1) {
    byte = static_cast<char>(byte ^ 1 << (bit % 8));
    [[maybe_unused]] const auto written = ::pwrite(descriptor, &byte, 1, at);
  }
  ::close(descriptor);
}

}  // namespace probebox::campaign
