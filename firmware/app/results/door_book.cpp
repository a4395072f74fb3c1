#include "firmware/app/results/door_book.hpp"

#include <algorithm>
#include <chrono>
#include <span>
#include <thread>
#include <utility>

#include "firmware/app/results/results_in_force.hpp"
#include "protocol/messages/fields.hpp"

namespace probebox::app {
namespace {

// Never change it: a file of another size is unreadable. TwinFile rounds it up to 8168 bytes, and an entry has up to
// 190.
constexpr std::size_t kMostBookBytes = 7168;
static_assert((DoorBook::kMostDoors + DoorBook::kMostPersons) * (2 * DoorBook::kMostName + 30) < 8168);
constexpr std::chrono::seconds kDoorPatience{2};
constexpr const char* kUnknown = "unknown: the file of inhibits was damaged";

// All that the file holds.
struct Content {
  std::vector<DoorEntry> doors{};
  static constexpr void fields(auto& self, auto&& field) { field("doors", self.doors, ""); }
};

std::vector<DoorEntry> doorsIn(const std::string& text) {
  const auto content = messages::decode<Content>(std::as_bytes(std::span{text}));
  return content ? content->doors : std::vector<DoorEntry>{};
}

std::string bookOf(const std::vector<DoorEntry>& doors) {
  const auto bytes = messages::encoded(Content{doors});
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// Whether a cut was on nobody knows: a person looks, and clears it by this name.
std::string bookIfLost() {
  return bookOf({{.door = kUnknown, .word_order = 0, .inhibits = true, .by = {}, .since_utc = utcNow()}});
}

Error sayItAgain() {
  return Error{"The box takes nothing now: say it again."};
}

bool saysNothing(const DoorEntry& entry) {
  return !entry.inhibits && entry.word_order == 0;
}

const DoorEntry* find(const std::vector<DoorEntry>& doors, std::string_view door) {
  const auto found = std::ranges::find(doors, door, &DoorEntry::door);
  return found == doors.end() ? nullptr : &*found;
}

bool inhibitsIn(const std::vector<DoorEntry>& doors, std::string_view door) {
  const auto* entry = find(doors, door);
  return entry != nullptr && entry->inhibits;
}

std::uint16_t wordOrderIn(const std::vector<DoorEntry>& doors, std::string_view door) {
  const auto* entry = find(doors, door);
  return entry == nullptr ? std::uint16_t{0} : entry->word_order;
}

// Whether two lists hold the same of a door; who said so, and when, does not count.
bool agreeAbout(std::string_view door, const std::vector<DoorEntry>& a, const std::vector<DoorEntry>& b) {
  return inhibitsIn(a, door) == inhibitsIn(b, door) && wordOrderIn(a, door) == wordOrderIn(b, door);
}

bool isPerson(std::string_view door) {
  return door.starts_with("person:");
}

// Makes room for one more where all places of its kind are taken by doors that hold nothing.
std::optional<Error> whyNoRoom(std::vector<DoorEntry>& doors, std::string_view door) {
  const bool person = isPerson(door);
  const std::size_t most = person ? DoorBook::kMostPersons : DoorBook::kMostDoors;
  const auto isFull = [&] {
    const auto taken = std::ranges::count_if(doors, [&](const auto& each) { return isPerson(each.door) == person; });
    return static_cast<std::size_t>(taken) >= most;
  };
  if (isFull()) std::erase_if(doors, saysNothing);
  if (!isFull()) return std::nullopt;
  return Error{std::to_string(most) + (person ? " persons hold an inhibit already" : " doors hold something already") +
               ": clear what is no more needed."};
}

Outcome<DoorEntry*> findOrAdd(std::vector<DoorEntry>& doors, std::string_view door) {
  const auto found = std::ranges::find(doors, door, &DoorEntry::door);
  if (found != doors.end()) return &*found;
  if (door.size() > DoorBook::kMostName)
    return Error{"A name has up to " + std::to_string(DoorBook::kMostName) + " bytes."};
  if (auto full = whyNoRoom(doors, door)) return *std::move(full);
  return &doors.emplace_back(DoorEntry{.door = std::string{door}});
}

std::string problemOf(const store::TwinFile& file) {
  std::string all = file.notice();
  if (file.lost()) {
    all +=
        std::string{
            ". Word orders and inhibits of before are lost: have each controller write register 128 again, and "
            "clear the inhibit '"} +
        kUnknown + "' when no cut is on";
  }
  if (!file.whyNotWritable().empty()) all += (all.empty() ? "" : ". ") + file.whyNotWritable();
  return all;
}

}  // namespace

DoorBook::DoorBook(const std::string& path, std::function<bool(bool)> tell_core, store::Before before)
    : tell_core_{std::move(tell_core)},
      file_{store::TwinFile::open(path, kMostBookBytes, bookIfLost(), before)},
      doors_{doorsIn(file_.content())},
      stored_{doors_},
      problem_{problemOf(file_)} {}

std::string DoorBook::problem() const {
  const std::lock_guard lock{mutex_};
  return problem_;
}

std::uint16_t DoorBook::wordOrder(std::string_view door) const {
  const std::lock_guard lock{mutex_};
  return wordOrderIn(doors_, door);
}

bool DoorBook::inhibits(std::string_view door) const {
  const std::lock_guard lock{mutex_};
  return inhibitsIn(doors_, door);
}

// While changing_ or mutex_ is held.
bool DoorBook::isStored(std::string_view door) const {
  return !unsure_.contains(door) && agreeAbout(door, doors_, stored_);
}

bool DoorBook::anyInhibits() const {
  const std::lock_guard lock{mutex_};
  return std::ranges::any_of(doors_, &DoorEntry::inhibits);
}

std::vector<DoorEntry> DoorBook::holders() const {
  const std::lock_guard lock{mutex_};
  std::vector<DoorEntry> all;
  std::ranges::copy_if(doors_, std::back_inserter(all), &DoorEntry::inhibits);
  return all;
}

// A door that waits comes first, however many results wait as well.
std::optional<CutLock> DoorBook::tryLockOutCuts() {
  if (declaring_ > 0) return std::nullopt;
  CutLock cut_lock{changing_};
  if (declaring_ > 0 || anyInhibits()) return std::nullopt;
  return cut_lock;
}

std::optional<Error> DoorBook::keepWordOrder(std::string_view door, std::uint16_t order) {
  const CutLock lock{changing_, kDoorPatience};
  if (!lock) return sayItAgain();
  if (wordOrder(door) == order && isStored(door)) return std::nullopt;
  Doors doors = doors_;
  TRY(const auto entry, findOrAdd(doors, door));
  entry->word_order = order;
  if (auto failed = store(doors)) return failed;
  show(std::move(doors));
  return std::nullopt;
}

std::optional<Error> DoorBook::setInhibit(std::string_view door, bool active, std::string_view by) {
  {
    const std::lock_guard lock{mutex_};
    if (!untold_ && inhibitsIn(doors_, door) == active && isStored(door)) return std::nullopt;
  }
  declaring_ += active ? 1 : 0;
  const CutLock lock{changing_, kDoorPatience};
  declaring_ -= active ? 1 : 0;
  if (!lock) return sayItAgain();
  if (inhibits(door) != active || !isStored(door)) return change(door, active, by);
  return untold_ ? tellCore() : std::nullopt;
}

std::optional<Error> DoorBook::clearInhibit(std::string_view door, std::string_view by) {
  const CutLock lock{changing_, kDoorPatience};
  if (!lock) return sayItAgain();
  if (inhibits(door)) return change(door, false, by);
  if (untold_ && find(doors_, door) != nullptr) return tellCore();
  std::string names;
  for (const auto& each : holders()) names.append(names.empty() ? "" : ", ").append(each.door);
  return Error{"'" + std::string{door} + "' holds no inhibit; " +
               (names.empty() ? "nobody does." : "these do: " + names + ".")};
}

std::optional<Error> DoorBook::change(std::string_view door, bool active, std::string_view by) {
  if (by.size() > kMostName) return Error{"A name has up to " + std::to_string(kMostName) + " bytes."};
  Doors doors = doors_;
  TRY(const auto entry, findOrAdd(doors, door));
  if (std::exchange(entry->inhibits, active) != active) {
    entry->by = by;
    entry->since_utc = utcNow();
  }
  const auto failed = store(doors);
  if (failed && !active) return Error{"The end of the cut cannot be stored, and the inhibit stays: " + failed->what};
  show(std::move(doors));
  if (auto untold = tellCore()) return untold;
  if (!failed) return std::nullopt;
  return Error{"The inhibit is in force until the box ends, and would not survive that: " + failed->what};
}

std::optional<Error> DoorBook::store(const Doors& doors) {
  const auto written = file_.write(bookOf(doors));
  const std::lock_guard lock{mutex_};
  if (!written) {
    // A disk that fails in mid-write may have either text.
    for (const auto& each : doors) {
      if (!agreeAbout(each.door, doors, stored_)) unsure_.insert(each.door);
    }
    return Error{written.error().what};
  }
  unsure_.clear();
  stored_ = doors;
  problem_ = problemOf(file_);  // a disk that was full at the start is not any more
  return std::nullopt;
}

void DoorBook::show(Doors doors) {
  const std::lock_guard lock{mutex_};
  doors_ = std::move(doors);
}

// While changing_ is held, so that the core hears of changes in the order in which they were made.
std::optional<Error> DoorBook::tellCore() {
  constexpr std::chrono::milliseconds kRound{1};
  bool told = tell_core_(anyInhibits());
  for (std::chrono::milliseconds waited{}; !told && waited < kDoorPatience; waited += kRound) {
    std::this_thread::sleep_for(kRound);
    told = tell_core_(anyInhibits());
  }
  {
    const std::lock_guard lock{mutex_};
    untold_ = !told;
  }
  if (told) return std::nullopt;
  return sayItAgain();
}

}  // namespace probebox::app
