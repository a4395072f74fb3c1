#include "firmware/app/update/bundle_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>
#include <utility>
#include <vector>

#include "protocol/messages/fields.hpp"
#include "protocol/units/megabytes.hpp"

namespace probebox::app {
namespace {

constexpr std::size_t kMostOfferBytes = 1024;
constexpr std::size_t kMostName = 200;  // bytes of a name or a version that are kept
constexpr std::size_t kSlice = 1U << 20U;

// Content of the file `offer`.
struct KeptOffer {
  std::string name{};
  std::string version{};
  std::uint64_t total_bytes{};
  messages::Sha256 sha256{};
  std::uint64_t stored_bytes{};
  std::uint64_t installation{};
  static constexpr void fields(auto& self, auto&& field) {
    field("name", self.name, "");
    field("version", self.version, "");
    field("total_bytes", self.total_bytes, "");
    field("sha256", self.sha256, "");
    field("stored_bytes", self.stored_bytes, "");
    field("installation", self.installation, "");
  }
};

KeptOffer keptIn(const store::TwinFile& file) {
  const auto kept = messages::decode<KeptOffer>(std::as_bytes(std::span{file.content()}));
  return kept ? *kept : KeptOffer{};
}

// Names of new files and folders in it survive a power cut.
bool syncFolder(const std::filesystem::path& path) {
  const io::Descriptor folder{::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)};
  return folder && ::fsync(folder.get()) == 0;
}

std::filesystem::path made(std::filesystem::path folder) {
  std::error_code cannot;  // is said when a bundle comes
  if (std::filesystem::create_directories(folder, cannot)) syncFolder(folder.parent_path());
  return folder;
}

std::uint64_t sizeOf(int file) {
  struct stat about {};
  return ::fstat(file, &about) == 0 ? static_cast<std::uint64_t>(about.st_size) : 0;
}

}  // namespace

BundleFile::BundleFile(std::filesystem::path folder)
    : folder_{made(std::move(folder))},
      offer_{store::TwinFile::open((folder_ / "offer").string(), kMostOfferBytes, {})} {
  restore();
}

// Bytes received but not yet recorded in `offer` may be damaged by a power cut and are sent again.
void BundleFile::restore() {
  const auto kept = keptIn(offer_);
  if (kept.total_bytes == 0) return drop();
  bundle_ = Bundle{.name = kept.name, .version = kept.version, .total_bytes = kept.total_bytes, .sha256 = kept.sha256};
  if (!open() || sizeOf(file_.get()) < kept.stored_bytes || kept.stored_bytes > kept.total_bytes ||
      ::ftruncate(file_.get(), static_cast<off_t>(kept.stored_bytes)) != 0)
    return drop();
  received_ = stored_ = kept.stored_bytes;
  installation_ = kept.installation;
}

Outcome<void> BundleFile::open() {
  constexpr mode_t kOwnerOnly = 0600;
  const auto path = (folder_ / "bundle").string();
  file_ = io::Descriptor{::open(path.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, kOwnerOnly)};
  if (!file_) return Error{path + " cannot be opened: " + std::strerror(errno)};
  if (!syncFolder(folder_)) return Error{folder_.string() + ": " + std::strerror(errno)};
  return {};
}

std::optional<Error> BundleFile::fail(const std::string& doing, int error) {
  drop();
  if (error == ENOSPC || error == EDQUOT)
    return Error{
        "disk-full: the box's disk has filled up, and what came of the bundle is removed: use a smaller bundle."};
  return Error{"disk-failed: " + doing + ": " + std::strerror(error) + ". Check the disk of the box."};
}

std::optional<Error> BundleFile::note(std::uint64_t stored, std::uint64_t installation) {
  const KeptOffer kept{.name = bundle_->name.substr(0, kMostName),
                       .version = bundle_->version.substr(0, kMostName),
                       .total_bytes = bundle_->total_bytes,
                       .sha256 = bundle_->sha256,
                       .stored_bytes = stored,
                       .installation = installation};
  const auto bytes = messages::encoded(kept);
  const auto written = offer_.write({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  if (!written) return Error{"disk-failed: " + written.error().what};
  stored_ = stored;
  installation_ = installation;
  return std::nullopt;
}

std::optional<Error> BundleFile::begin(const Bundle& bundle) {
  if (bundle.total_bytes > kMost)
    return Error{"too-large: the bundle has " + inMegabytes(bundle.total_bytes) + ", and a box takes " +
                 inMegabytes(kMost) + " at most."};
  const bool same = bundle_ && bundle_->sha256 == bundle.sha256 && bundle_->total_bytes == bundle.total_bytes;
  if (!same) drop();
  struct statvfs disk {};
  if (::statvfs(folder_.c_str(), &disk) != 0)
    return Error{"disk-failed: " + folder_.string() + ": " + std::strerror(errno) + ". Check the disk of the box."};
  const std::uint64_t room = std::uint64_t{disk.f_bavail} * disk.f_frsize;
  const std::uint64_t most = room > kSpare ? room - kSpare : 0;
  if (bundle.total_bytes > most || 2 * bundle.total_bytes - received_ > most) {
    return Error{"disk-full: the bundle has " + inMegabytes(bundle.total_bytes) +
                 " and is needed twice, and the box has " + inMegabytes(room) + " left, of which " +
                 inMegabytes(kSpare) + " stay free for results."};
  }
  if (!same) {
    if (const auto opened = open(); !opened) return Error{"disk-failed: " + opened.error().what};
    if (::ftruncate(file_.get(), 0) != 0) return fail("the old bundle cannot be removed", errno);
  }
  bundle_ = bundle;
  return note(stored_, 0);
}

std::optional<Error> BundleFile::append(std::span<const std::byte> bytes) {
  for (auto left = bytes; !left.empty();) {
    const auto written = ::pwrite(file_.get(), left.data(), left.size(), static_cast<off_t>(received_));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return fail("the bundle cannot be written", written == 0 ? ENOSPC : errno);
    received_ += static_cast<std::uint64_t>(written);
    left = left.subspan(static_cast<std::size_t>(written));
  }
  return std::nullopt;
}

std::optional<Error> BundleFile::store() {
  if (!bundle_ || stored_ == received_) return std::nullopt;
  if (::fdatasync(file_.get()) != 0) return fail("the bundle cannot be stored", errno);
  return note(received_, installation_);
}

std::optional<Error> BundleFile::setInstallation(std::uint64_t installation) {
  return bundle_ ? note(stored_, installation) : std::nullopt;
}

void BundleFile::drop() {
  if (keptIn(offer_).total_bytes > 0) {
    // An offer that cannot be cleared finds no file that belongs to it.
    const auto bytes = messages::encoded(KeptOffer{});
    static_cast<void>(offer_.write({reinterpret_cast<const char*>(bytes.data()), bytes.size()}));
  }
  file_.close();
  ::unlink((folder_ / "bundle").c_str());
  bundle_.reset();
  received_ = stored_ = installation_ = hashed_ = 0;
}

void BundleFile::beginCheck() {
  hash_ = {};
  hashed_ = 0;
}

Outcome<BundleFile::Check> BundleFile::check() {
  std::vector<std::byte> piece(std::min<std::uint64_t>(kSlice, received_ - hashed_));
  const auto got = ::pread(file_.get(), piece.data(), piece.size(), static_cast<off_t>(hashed_));
  if (got < 0 || (got == 0 && !piece.empty())) return *fail("the bundle cannot be read", got < 0 ? errno : EIO);
  hash_.add(std::span{piece}.first(static_cast<std::size_t>(got)));
  hashed_ += static_cast<std::uint64_t>(got);
  if (hashed_ < received_) return Check::going_on;
  return hash_.digest() == bundle_->sha256 ? Check::good : Check::bad;
}

std::uint8_t BundleFile::checkedPercent() const {
  return bundle_ ? static_cast<std::uint8_t>(100 * hashed_ / bundle_->total_bytes) : std::uint8_t{0};
}

}  // namespace probebox::app
