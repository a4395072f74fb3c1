#include "host-tests/faults/call.hpp"

#include <algorithm>
#include <array>
#include <climits>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <sys/syscall.h>
#include <unistd.h>

#include "drivers/io/descriptor.hpp"

namespace probebox::faults {
namespace {

using Arguments = decltype(seccomp_data::args);

std::string procOf(std::uint32_t process, const std::string& what) {
  return "/proc/" + std::to_string(process) + "/" + what;
}

std::vector<char> memoryOf(std::uint32_t process, std::uint64_t address, std::size_t size) {
  const io::Descriptor memory{::open(procOf(process, "mem").c_str(), O_RDONLY | O_CLOEXEC)};
  std::vector<char> bytes(size);
  const auto got = ::pread(memory.get(), bytes.data(), size, static_cast<off_t>(address));
  bytes.resize(static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
  return bytes;
}

std::string textAt(std::uint32_t process, std::uint64_t address) {
  const auto bytes = memoryOf(process, address, PATH_MAX);
  return {bytes.begin(), std::ranges::find(bytes, '\0')};
}

// Relative paths are not followed: the programs under test name their files absolutely.
std::string pathOf(std::uint32_t process, std::uint64_t descriptor) {
  std::error_code none;
  return std::filesystem::read_symlink(procOf(process, "fd/" + std::to_string(static_cast<int>(descriptor))), none)
      .string();
}

struct Opened {
  std::uint64_t position{};
  bool appends{};
};

Opened openedAs(std::uint32_t process, std::uint64_t descriptor) {
  std::ifstream file{procOf(process, "fdinfo/" + std::to_string(static_cast<int>(descriptor)))};
  Opened opened;
  for (std::string key, value; file >> key >> value;) {
    if (key == "pos:") opened.position = std::stoull(value);
    if (key == "flags:") opened.appends = (std::stoull(value, nullptr, 8) & O_APPEND) != 0;
  }
  return opened;
}

Call onDescriptor(Call::Kind kind, std::uint32_t process, const Arguments& with) {
  return {.kind = kind, .path = pathOf(process, with[0]), .descriptor = static_cast<int>(with[0])};
}

Call opening(std::uint32_t process, std::uint64_t path, std::uint64_t flags) {
  return {.kind = Call::Kind::open,
          .path = textAt(process, path),
          .creates = (flags & O_CREAT) != 0,
          .truncates = (flags & O_TRUNC) != 0};
}

Call writing(std::uint32_t process, const Arguments& with, bool at_offset) {
  auto call = onDescriptor(Call::Kind::write, process, with);
  call.at_offset = at_offset;
  call.offset = with[3];
  if (!at_offset) {
    const auto opened = openedAs(process, with[0]);
    std::error_code none;
    call.offset = opened.appends ? std::filesystem::file_size(call.path, none) : opened.position;
  }
  call.bytes = memoryOf(process, with[1], with[2]);
  return call;
}

Call naming(Call::Kind kind, std::uint32_t process, std::uint64_t path, std::uint64_t to = 0) {
  Call call{.kind = kind, .path = textAt(process, path)};
  if (to != 0) call.to = textAt(process, to);
  return call;
}

struct Known {
  int number;
  Call (*decode)(std::uint32_t process, const Arguments& with);
};

using Process = std::uint32_t;
using With = const Arguments&;

constexpr Known kKnown[] = {
    {SYS_openat, [](Process p, With a) { return opening(p, a[1], a[2]); }},
    {SYS_read, [](Process p, With a) { return onDescriptor(Call::Kind::read, p, a); }},
    {SYS_pread64, [](Process p, With a) { return onDescriptor(Call::Kind::read, p, a); }},
    {SYS_write, [](Process p, With a) { return writing(p, a, false); }},
    {SYS_pwrite64, [](Process p, With a) { return writing(p, a, true); }},
    {SYS_fsync, [](Process p, With a) { return onDescriptor(Call::Kind::sync, p, a); }},
    {SYS_fdatasync, [](Process p, With a) { return onDescriptor(Call::Kind::sync, p, a); }},
    {SYS_ftruncate,
     [](Process p, With a) {
       auto call = onDescriptor(Call::Kind::truncate, p, a);
       call.size = a[1];
       return call;
     }},
    {SYS_renameat, [](Process p, With a) { return naming(Call::Kind::rename, p, a[1], a[3]); }},
    {SYS_renameat2, [](Process p, With a) { return naming(Call::Kind::rename, p, a[1], a[3]); }},
    {SYS_linkat, [](Process p, With a) { return naming(Call::Kind::link, p, a[1], a[3]); }},
    {SYS_unlinkat, [](Process p, With a) { return naming(Call::Kind::remove, p, a[1]); }},
    {SYS_mkdirat, [](Process p, With a) { return naming(Call::Kind::make_folder, p, a[1]); }},
#ifdef SYS_open
    {SYS_open, [](Process p, With a) { return opening(p, a[0], a[1]); }},
    {SYS_creat, [](Process p, With a) { return opening(p, a[0], O_CREAT | O_TRUNC); }},
    {SYS_rename, [](Process p, With a) { return naming(Call::Kind::rename, p, a[0], a[1]); }},
    {SYS_link, [](Process p, With a) { return naming(Call::Kind::link, p, a[0], a[1]); }},
    {SYS_unlink, [](Process p, With a) { return naming(Call::Kind::remove, p, a[0]); }},
    {SYS_mkdir, [](Process p, With a) { return naming(Call::Kind::make_folder, p, a[0]); }},
#endif
};

}  // namespace

std::string describe(const Call& call) {
  constexpr std::array<const char*, 9> kNames{"open",   "read", "write",  "sync",       "truncate",
                                              "rename", "link", "remove", "make folder"};
  std::string text = std::string{kNames.at(static_cast<std::size_t>(call.kind))} + " " +
                     std::filesystem::path{call.path}.filename().string();
  if (call.kind == Call::Kind::write)
    text += ", " + std::to_string(call.bytes.size()) + " bytes at " + std::to_string(call.offset);
  return text;
}

const std::vector<int>& fileCalls() {
  static const std::vector<int> all = [] {
    std::vector<int> numbers;
    for (const auto& each : kKnown) numbers.push_back(each.number);
    return numbers;
  }();
  return all;
}

std::optional<Call> decode(const seccomp_notif& asked) {
  const auto* known = std::ranges::find(kKnown, asked.data.nr, &Known::number);
  if (known == std::end(kKnown)) return std::nullopt;
  auto call = known->decode(asked.pid, asked.data.args);
  if (!call.path.starts_with('/')) return std::nullopt;
  return call;
}

}  // namespace probebox::faults
