#include "firmware/store/opening.hpp"

#include <filesystem>
#include <sqlite3.h>
#include <system_error>

#include "firmware/store/rows.hpp"
#include "firmware/store/salvage.hpp"
#include "firmware/store/schema.hpp"
#include "firmware/store/set_aside.hpp"

namespace probebox::store {
namespace {

// One file beside its journal, and every commit on the disk before it is acknowledged: results are few and dear.
constexpr const char* kDurable = "PRAGMA journal_mode = DELETE; PRAGMA synchronous = EXTRA; PRAGMA foreign_keys = ON";

// Rows that do not match their checksums are marked before anybody asks for one.
Outcome<Done, Failure> checkRows(Database& database) {
  auto transaction = Transaction::begin(database);
  if (!transaction) return transaction.error();
  const auto before = sqlite3_total_changes(database.handle());
  if (const auto marked = markDamaged(database); !marked) return marked;
  // Where there was nothing to mark nothing is written, so that a full disk does not matter.
  return sqlite3_total_changes(database.handle()) == before ? Done{} : transaction->commit();
}

// notice: what was done to an older file that a person should know; or empty.
Outcome<Database, Failure> openSound(const std::string& path, std::string& notice) {
  auto database = Database::open(path);
  if (!database) return database.error();
  if (const auto sound = inspect(*database); !sound) return sound.error();
  if (database->readOnly()) return database->failure(SQLITE_READONLY);
  if (const auto durable = database->run(kDurable); !durable) return durable.error();
  auto ready = migrate(*database);
  if (!ready) return ready.error();
  notice = std::move(*ready);
  if (const auto checked = checkRows(*database); !checked) return checked.error();
  return database;
}

Opened opened(Database database, std::string notice) {
  return {std::make_unique<Database>(std::move(database)), std::move(notice)};
}

// SQLite takes a file of nothing for a new one; it was one of results, or the disk has lost it.
bool isEmptyFile(const std::string& path) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  return !error && size == 0;
}

Outcome<std::string, Failure> assignSalvaged(Database& database) {
  auto transaction = Transaction::begin(database);
  if (!transaction) return transaction.error();
  auto assigned = assignSubjects(database);
  if (!assigned) return assigned;
  if (const auto done = transaction->commit(); !done) return done.error();
  return assigned;
}

// Puts the file aside, begins a new one, and takes over what is whole.
Outcome<Opened, Failure> beginAnew(const std::string& path, const std::string& reason, const std::string& what) {
  const auto aside = setAside(path, reason);
  if (!aside) return aside.error();
  std::string notice;
  auto fresh = openSound(path, notice);
  if (!fresh) return fresh.error();
  const auto results = salvage(*aside, *fresh);
  // The file may have been of an earlier version.
  auto assigned = assignSalvaged(*fresh);
  if (!assigned) return assigned.error();
  // What is whole by its checksum may still contradict itself.
  if (const auto checked = checkRows(*fresh); !checked) return checked.error();
  return opened(std::move(fresh).value(),
                what + "; it was moved to " + *aside + ", and a new store was begun with " +
                    (results == 0 ? "nothing, because none of its results could be read"
                                  : "the " + std::to_string(results) + " results of it that are whole") +
                    ": see what is in force, restore a backup, or calibrate again" +
                    (assigned->empty() ? "" : ". " + *assigned));
}

// What can be read of a file that cannot be written, as a copy in memory.
Outcome<Database, Failure> copyOf(const std::string& path) {
  auto file = Database::openToRead(path);
  if (!file) return file.error();
  if (const auto sound = inspect(*file); !sound) return sound.error();
  auto copy = Database::inMemory();
  if (!copy) return copy.error();
  auto* backup = sqlite3_backup_init(copy->handle(), "main", file->handle(), "main");
  if (backup == nullptr) return copy->failure(sqlite3_errcode(copy->handle()));
  sqlite3_backup_step(backup, -1);
  if (const int code = sqlite3_backup_finish(backup); code != SQLITE_OK) return copy->failure(code);
  return copy;
}

}  // namespace

Outcome<Opened, Failure> openFile(const std::string& path) {
  if (isEmptyFile(path)) return beginAnew(path, "empty", path + " was empty, with not even the head of a store");
  std::string notice;
  auto first = openSound(path, notice);
  if (first) return opened(std::move(first).value(), std::move(notice));
  if (first.error().reason == Reason::damaged) return beginAnew(path, "damaged", first.error().what);
  if (first.error().reason == Reason::foreign_file) return beginAnew(path, "foreign", first.error().what);
  return first.error();
}

Opened openToReadAlone(const std::string& path, const std::string& why) {
  auto copy = copyOf(path);
  const bool is_read = copy.ok();
  // Memory takes what a disk refuses: an empty store can be had in any case.
  Database database = is_read ? std::move(copy).value() : Database::inMemory().value();
  (void)migrate(database);
  (void)checkRows(database);
  database.forbidWriting("nothing can be stored: " + why);
  return opened(std::move(database), "Nothing can be stored: " + why +
                                         (is_read ? ". What it has can be read." : ". Nothing of it can be read."));
}

}  // namespace probebox::store
