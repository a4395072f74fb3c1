#include "host-tests/faults/faulty_disk.hpp"

#include <array>
#include <cerrno>

namespace probebox::faults {
namespace {

using Kind = Call::Kind;
using What = Decision::What;

constexpr std::array<std::string_view, kFaults> kNames{"kill",          "cut-lost", "cut-torn", "fail-once",
                                                       "fail-for-good", "full",     "shorten"};

// A file in place takes what it has room for.
bool needsRoom(const Call& call) {
  std::error_code none;
  if (call.kind == Kind::make_folder || call.kind == Kind::link) return true;
  if (call.kind == Kind::open) return call.creates && !std::filesystem::exists(call.path, none);
  if (call.kind != Kind::write) return false;
  const auto size = std::filesystem::file_size(call.path, none);
  return none || call.offset + call.bytes.size() > size;
}

}  // namespace

std::string_view name(Fault fault) {
  return kNames.at(static_cast<std::size_t>(fault));
}

bool cutsPower(Fault fault) {
  return fault == Fault::cut_lost || fault == Fault::cut_torn;
}

Decision FaultyDisk::decide(const Call& call) {
  const auto decision = decisionAbout(call);
  if (decision.what == What::pass) image_.note(call);
  if (decision.what == What::shorten) image_.note(call, call.bytes.size() / 2);
  if (decision.what == What::fail) folder_failed_ |= call.kind == Kind::open && call.path == folder_;
  return decision;
}

void FaultyDisk::cutPower() const {
  image_.cutPower(fault_ == Fault::cut_torn ? DiskImage::Unsynced::torn : DiskImage::Unsynced::lost, call_);
}

Decision FaultyDisk::decisionAbout(const Call& call) {
  const bool of_the_disk = fault_ != Fault::kill && !cutsPower(fault_);
  if (of_the_disk && call.path.ends_with(kInMemory)) return {};
  ++calls_;
  if (calls_ == call_) {
    reached_ = applies_ = true;
    at_ = describe(call);
  }
  if (calls_ < call_) return {};
  switch (fault_) {
    case Fault::kill:
    case Fault::cut_lost:
    case Fault::cut_torn:
      return {.what = What::kill};
    case Fault::fail_once:
      return calls_ == call_ ? Decision{.what = What::fail, .error = EIO} : Decision{};
    case Fault::fail_for_good:
      return {.what = What::fail, .error = EIO};
    case Fault::full:
      return needsRoom(call) ? Decision{.what = What::fail, .error = ENOSPC} : Decision{};
    case Fault::shorten:
      if (calls_ != call_) return {};
      applies_ = call.kind == Kind::write && call.at_offset && call.bytes.size() > 1;
      return applies_ ? Decision{.what = What::shorten} : Decision{};
  }
  return {};
}

}  // namespace probebox::faults
