#include "firmware/store/opening.hpp"

#include <filesystem>
#include <system_error>

#include "firmware/store/schema.hpp"

namespace probebox::store {
namespace {

namespace fs = std::filesystem;

// One file beside its journal, and every commit on the disk before it is acknowledged: results are few and dear.
constexpr const char* kDurable = "PRAGMA journal_mode = DELETE; PRAGMA synchronous = EXTRA; PRAGMA foreign_keys = ON";

Outcome<Database, Failure> openSound(const std::string& path) {
  auto database = Database::open(path);
  if (!database) return database.error();
  if (const auto sound = inspect(*database); !sound) return sound.error();
  if (database->readOnly()) return database->failure(SQLITE_READONLY);
  if (const auto durable = database->run(kDurable); !durable) return durable.error();
  if (const auto ready = migrate(*database); !ready) return ready.error();
  return database;
}

std::string freeName(const std::string& path) {
  for (int number = 1;; ++number) {
    const std::string candidate = path + ".damaged-" + std::to_string(number);
    if (std::error_code error; !fs::exists(fs::symlink_status(candidate, error))) return candidate;
  }
}

// The journal goes with its file: an expert may still get something out of the two together.
Outcome<std::string, Failure> moveAside(const std::string& path) {
  const std::string aside = freeName(path);
  std::error_code error;
  fs::rename(path, aside, error);
  if (error) {
    return Failure{Reason::damaged, path + " is damaged and cannot be moved aside (" + error.message() +
                                        "); move it away by hand, or name another state directory"};
  }
  for (const char* companion : {"-journal", "-wal", "-shm"}) {
    std::error_code absent;
    fs::rename(path + companion, aside + companion, absent);
  }
  return aside;
}

Opened opened(Database database, std::string notice) {
  return {std::make_unique<Database>(std::move(database)), std::move(notice)};
}

}  // namespace

Outcome<Opened, Failure> openFile(const std::string& path) {
  auto first = openSound(path);
  if (first) return opened(std::move(first).value(), "");
  if (first.error().reason != Reason::damaged) return first.error();
  const auto aside = moveAside(path);
  if (!aside) return aside.error();
  auto second = openSound(path);
  if (!second) return second.error();
  return opened(std::move(second).value(),
                first.error().what + "; it was moved to " + aside.value() +
                    " and a new, empty store was begun: restore a backup, or calibrate again");
}

}  // namespace probebox::store
