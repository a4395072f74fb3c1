#include "firmware/app/results/connection_inhibits.hpp"

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
static_assert((ConnectionInhibits::kMostConnections + ConnectionInhibits::kMostPersons) *
                  (2 * ConnectionInhibits::kMostName + 30) <
              8168);
constexpr std::chrono::seconds kLockPatience{2};
constexpr const char* kUnknown = "unknown: the file of inhibits was damaged";

// All that the file holds.
struct Content {
  std::vector<ConnectionEntry> connections{};
  static constexpr void fields(auto& self, auto&& field) { field("connections", self.connections, ""); }
};

std::vector<ConnectionEntry> connectionsIn(const std::string& text) {
  const auto content = messages::decode<Content>(std::as_bytes(std::span{text}));
  return content ? content->connections : std::vector<ConnectionEntry>{};
}

std::string bookOf(const std::vector<ConnectionEntry>& connections) {
  const auto bytes = messages::encoded(Content{connections});
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// Whether a cut was on nobody knows: a person looks, and clears it by this name.
std::string bookIfLost() {
  return bookOf({{.connection = kUnknown, .word_order = 0, .inhibits = true, .by = {}, .since_utc = utcNow()}});
}

Error sayItAgain() {
  return Error{"The box takes nothing now: say it again."};
}

bool saysNothing(const ConnectionEntry& entry) {
  return !entry.inhibits && entry.word_order == 0;
}

const ConnectionEntry* find(const std::vector<ConnectionEntry>& connections, std::string_view connection) {
  const auto found = std::ranges::find(connections, connection, &ConnectionEntry::connection);
  return found == connections.end() ? nullptr : &*found;
}

bool inhibitsIn(const std::vector<ConnectionEntry>& connections, std::string_view connection) {
  const auto* entry = find(connections, connection);
  return entry != nullptr && entry->inhibits;
}

std::uint16_t wordOrderIn(const std::vector<ConnectionEntry>& connections, std::string_view connection) {
  const auto* entry = find(connections, connection);
  return entry == nullptr ? std::uint16_t{0} : entry->word_order;
}

// Whether two lists hold the same of a connection; who said so, and when, does not count.
bool agreeAbout(std::string_view connection, const std::vector<ConnectionEntry>& a,
                const std::vector<ConnectionEntry>& b) {
  return inhibitsIn(a, connection) == inhibitsIn(b, connection) &&
         wordOrderIn(a, connection) == wordOrderIn(b, connection);
}

bool isPerson(std::string_view connection) {
  return connection.starts_with("person:");
}

// Makes room for one more where all places of its kind are taken by connections that hold nothing.
std::optional<Error> whyNoRoom(std::vector<ConnectionEntry>& connections, std::string_view connection) {
  const bool person = isPerson(connection);
  const std::size_t most = person ? ConnectionInhibits::kMostPersons : ConnectionInhibits::kMostConnections;
  const auto isFull = [&] {
    const auto taken =
        std::ranges::count_if(connections, [&](const auto& each) { return isPerson(each.connection) == person; });
    return static_cast<std::size_t>(taken) >= most;
  };
  if (isFull()) std::erase_if(connections, saysNothing);
  if (!isFull()) return std::nullopt;
  return Error{std::to_string(most) +
               (person ? " persons hold an inhibit already" : " connections hold something already") +
               ": clear what is no more needed."};
}

Outcome<ConnectionEntry*> findOrAdd(std::vector<ConnectionEntry>& connections, std::string_view connection) {
  const auto found = std::ranges::find(connections, connection, &ConnectionEntry::connection);
  if (found != connections.end()) return &*found;
  if (connection.size() > ConnectionInhibits::kMostName)
    return Error{"A name has up to " + std::to_string(ConnectionInhibits::kMostName) + " bytes."};
  if (auto full = whyNoRoom(connections, connection)) return *std::move(full);
  return &connections.emplace_back(ConnectionEntry{.connection = std::string{connection}});
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

ConnectionInhibits::ConnectionInhibits(const std::string& path, std::function<bool(bool)> tell_core,
                                       store::Before before)
    : tell_core_{std::move(tell_core)},
      file_{store::TwinFile::open(path, kMostBookBytes, bookIfLost(), before)},
      connections_{connectionsIn(file_.content())},
      stored_{connections_},
      problem_{problemOf(file_)} {}

std::string ConnectionInhibits::problem() const {
  const std::lock_guard lock{mutex_};
  return problem_;
}

std::uint16_t ConnectionInhibits::wordOrder(std::string_view connection) const {
  const std::lock_guard lock{mutex_};
  return wordOrderIn(connections_, connection);
}

bool ConnectionInhibits::inhibits(std::string_view connection) const {
  const std::lock_guard lock{mutex_};
  return inhibitsIn(connections_, connection);
}

// While changing_ or mutex_ is held.
bool ConnectionInhibits::isStored(std::string_view connection) const {
  return !unsure_.contains(connection) && agreeAbout(connection, connections_, stored_);
}

bool ConnectionInhibits::anyInhibits() const {
  const std::lock_guard lock{mutex_};
  return std::ranges::any_of(connections_, &ConnectionEntry::inhibits);
}

std::vector<ConnectionEntry> ConnectionInhibits::holders() const {
  const std::lock_guard lock{mutex_};
  std::vector<ConnectionEntry> all;
  std::ranges::copy_if(connections_, std::back_inserter(all), &ConnectionEntry::inhibits);
  return all;
}

// A connection that waits comes first, however many results wait as well.
std::optional<CutLock> ConnectionInhibits::tryLockOutCuts() {
  if (declaring_ > 0) return std::nullopt;
  CutLock cut_lock{changing_};
  if (declaring_ > 0 || anyInhibits()) return std::nullopt;
  return cut_lock;
}

std::optional<Error> ConnectionInhibits::keepWordOrder(std::string_view connection, std::uint16_t order) {
  const CutLock lock{changing_, kLockPatience};
  if (!lock) return sayItAgain();
  if (wordOrder(connection) == order && isStored(connection)) return std::nullopt;
  Connections connections = connections_;
  TRY(const auto entry, findOrAdd(connections, connection));
  entry->word_order = order;
  if (auto failed = store(connections)) return failed;
  show(std::move(connections));
  return std::nullopt;
}

std::optional<Error> ConnectionInhibits::setInhibit(std::string_view connection, bool active, std::string_view by) {
  {
    const std::lock_guard lock{mutex_};
    if (!unreported_ && inhibitsIn(connections_, connection) == active && isStored(connection)) return std::nullopt;
  }
  declaring_ += active ? 1 : 0;
  const CutLock lock{changing_, kLockPatience};
  declaring_ -= active ? 1 : 0;
  if (!lock) return sayItAgain();
  if (inhibits(connection) != active || !isStored(connection)) return change(connection, active, by);
  return unreported_ ? tellCore() : std::nullopt;
}

std::optional<Error> ConnectionInhibits::clearInhibit(std::string_view connection, std::string_view by) {
  const CutLock lock{changing_, kLockPatience};
  if (!lock) return sayItAgain();
  if (inhibits(connection)) return change(connection, false, by);
  if (unreported_ && find(connections_, connection) != nullptr) return tellCore();
  std::string names;
  for (const auto& each : holders()) names.append(names.empty() ? "" : ", ").append(each.connection);
  return Error{"'" + std::string{connection} + "' holds no inhibit; " +
               (names.empty() ? "nobody does." : "these do: " + names + ".")};
}

std::optional<Error> ConnectionInhibits::change(std::string_view connection, bool active, std::string_view by) {
  if (by.size() > kMostName) return Error{"A name has up to " + std::to_string(kMostName) + " bytes."};
  Connections connections = connections_;
  TRY(const auto entry, findOrAdd(connections, connection));
  if (std::exchange(entry->inhibits, active) != active) {
    entry->by = by;
    entry->since_utc = utcNow();
  }
  const auto failed = store(connections);
  if (failed && !active) return Error{"The end of the cut cannot be stored, and the inhibit stays: " + failed->what};
  show(std::move(connections));
  if (auto unreported = tellCore()) return unreported;
  if (!failed) return std::nullopt;
  return Error{"The inhibit is in force until the box ends, and would not survive that: " + failed->what};
}

std::optional<Error> ConnectionInhibits::store(const Connections& connections) {
  const auto written = file_.write(bookOf(connections));
  const std::lock_guard lock{mutex_};
  if (!written) {
    // A disk that fails in mid-write may have either text.
    for (const auto& each : connections) {
      if (!agreeAbout(each.connection, connections, stored_)) unsure_.insert(each.connection);
    }
    return Error{written.error().what};
  }
  unsure_.clear();
  stored_ = connections;
  problem_ = problemOf(file_);  // a disk that was full at the start is not any more
  return std::nullopt;
}

void ConnectionInhibits::show(Connections connections) {
  const std::lock_guard lock{mutex_};
  connections_ = std::move(connections);
}

// While changing_ is held, so that the core hears of changes in the order in which they were made.
std::optional<Error> ConnectionInhibits::tellCore() {
  constexpr std::chrono::milliseconds kRound{1};
  bool told = tell_core_(anyInhibits());
  for (std::chrono::milliseconds waited{}; !told && waited < kLockPatience; waited += kRound) {
    std::this_thread::sleep_for(kRound);
    told = tell_core_(anyInhibits());
  }
  {
    const std::lock_guard lock{mutex_};
    unreported_ = !told;
  }
  if (told) return std::nullopt;
  return sayItAgain();
}

}  // namespace probebox::app
