#include "kernel_files.hpp"

#include <cerrno>
#include <fcntl.h>
#include <fstream>
#include <system_error>
#include <unistd.h>

namespace probebox::vm {

void writeTo(const std::string& path, std::string_view text) {
  const int fd = open(path.c_str(), O_WRONLY | O_CLOEXEC);
  const bool written = fd >= 0 && write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  const int code = errno;
  if (fd >= 0) close(fd);
  if (!written) throw std::system_error{code, std::generic_category(), path};
}

std::string readFrom(const std::string& path) {
  std::ifstream file{path};
  std::string line;
  if (!file) throw std::system_error{errno, std::generic_category(), path};
  std::getline(file, line);
  return line;
}

}  // namespace probebox::vm
