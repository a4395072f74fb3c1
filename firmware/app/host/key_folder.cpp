#include "firmware/app/host/key_folder.hpp"

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <string>
#include <string_view>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

#include "board/describe/file_content.hpp"
#include "drivers/io/descriptor.hpp"
#include "firmware/app/host/tls_door.hpp"

namespace probebox::app {
namespace {

constexpr const char* kCertificate = "box.crt";
constexpr const char* kKey = "box.key";
constexpr const char* kPeopleCa = "people.crt";

board::TlsKeys keysIn(const std::filesystem::path& folder) {
  return {.certificate = folder / kCertificate, .key = folder / kKey, .people_ca = folder / kPeopleCa, .shut_out = {}};
}

bool isWritten(const std::filesystem::path& path, std::string_view text) {
  const io::Descriptor file{open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0600)};
  return file && write(file.get(), text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
         fsync(file.get()) == 0;
}

bool isSynced(const std::filesystem::path& folder) {
  const io::Descriptor opened{open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)};
  return opened && fsync(opened.get()) == 0;
}

Error notStored() {
  return {std::string{"The keys cannot be stored ("} + std::strerror(errno) + "): see probebox status."};
}

}  // namespace

board::TlsKeys KeyFolder::in(board::TlsKeys named) const {
  if (!named.areProvisioned()) return named;
  auto own = keysIn(folder_);
  own.shut_out = std::move(named.shut_out);
  return own;
}

bool KeyFolder::haveOtherPeople(const messages::ProvisionKeys::Request& keys) const {
  std::error_code ignored;
  if (!std::filesystem::exists(folder_, ignored)) return false;
  const auto there = board::fileContent((folder_ / kPeopleCa).string());
  return !there || *there != keys.people_ca;
}

std::optional<Error> KeyFolder::write(const messages::ProvisionKeys::Request& keys) const {
  const auto next = folder_.string() + ".new";
  // However this ends, no key stays where none belongs.
  struct Removed {
    std::filesystem::path path;
    explicit Removed(std::filesystem::path folder) : path{std::move(folder)} { remove(); }
    Removed(const Removed&) = delete;
    Removed& operator=(const Removed&) = delete;
    ~Removed() { remove(); }
    void remove() const {
      const int why = errno;
      std::error_code ignored;
      std::filesystem::remove_all(path, ignored);
      errno = why;
    }
  };
  const Removed removed{next};
  if (mkdir(next.c_str(), 0700) != 0) return notStored();
  const auto files = keysIn(next);
  if (!isWritten(files.certificate, keys.certificate) || !isWritten(files.key, keys.key) ||
      !isWritten(files.people_ca, keys.people_ca) || !isSynced(next))
    return notStored();
  if (auto why = whyNoKeys(files)) return Error{"The keys are not taken: " + why->what + "."};
  // One step, so that never the certificate of one pair lies beside the key of another.
  const bool is_there = access(folder_.c_str(), F_OK) == 0;
  if (renameat2(AT_FDCWD, next.c_str(), AT_FDCWD, folder_.c_str(), is_there ? RENAME_EXCHANGE : 0) != 0)
    return notStored();
  if (!isSynced(folder_.parent_path())) return notStored();
  return std::nullopt;
}

}  // namespace probebox::app
