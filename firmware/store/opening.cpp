#include "firmware/store/opening.hpp"

#include <filesystem>
#include <sqlite3.h>
#include <system_error>

#include "firmware/store/copy_before.hpp"
#include "firmware/store/rows.hpp"
#include "firmware/store/salvage.hpp"
#include "firmware/store/schema.hpp"
#include "firmware/store/set_aside.hpp"

namespace probebox::store {
namespace {

// Rows that do not match their checksums are marked before anybody asks for one.
Outcome<void, Failure> checkRows(Database& database) {
  TRY(auto transaction, Transaction::begin(database));
  const auto before = sqlite3_total_changes(database.handle());
  TRY(markDamaged(database));
  // Where there was nothing to mark nothing is written, so that a full disk does not matter.
  if (sqlite3_total_changes(database.handle()) == before) return {};
  return transaction.commit();
}

// A migration has no way back, but a box may go back to the version before.
Outcome<void, Failure> keepBeforeMigration(Database& database) {
  TRY(const auto schema, database.number("PRAGMA user_version"));
  if (schema == 0 || schema >= knownSchema()) return {};
  return keepCopyBefore(database, schema);
}

// notice: what was done to an older file that a person should know; or empty.
Outcome<Database, Failure> openSound(const std::string& path, std::string& notice) {
  TRY(auto database, Database::open(path));
  TRY(inspect(database));
  if (database.readOnly()) return database.failure(SQLITE_READONLY);
  TRY(database.run(kDurable));
  TRY(keepBeforeMigration(database));
  TRY(auto ready, migrate(database));
  notice = std::move(ready);
  TRY(checkRows(database));
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
  TRY(auto transaction, Transaction::begin(database));
  auto assigned = assignSubjects(database);
  if (!assigned) return assigned;
  TRY(transaction.commit());
  return assigned;
}

// Puts the file aside, begins a new one, and takes over what is whole.
Outcome<Opened, Failure> beginAnew(const std::string& path, const std::string& reason, const std::string& what) {
  TRY(const auto aside, setAside(path, reason));
  std::string notice;
  TRY(auto fresh, openSound(path, notice));
  const auto results = salvage(aside, fresh);
  // The file may have been of an earlier version.
  TRY(auto assigned, assignSalvaged(fresh));
  // A file with a good checksum may still contradict itself.
  TRY(checkRows(fresh));
  return opened(std::move(fresh),
                what + "; it was moved to " + aside + ", and a new store was begun with " +
                    (results == 0 ? "nothing, because none of its results could be read"
                                  : "the " + std::to_string(results) + " results of it that are whole") +
                    ": see what is in force, restore a backup, or calibrate again" +
                    (assigned.empty() ? "" : ". " + assigned));
}

// Copies into memory what can be read of a file that cannot be written.
Outcome<Database, Failure> copyOf(const std::string& path) {
  TRY(auto file, Database::openToRead(path));
  TRY(inspect(file));
  TRY(auto copy, Database::inMemory());
  TRY(file.copyInto(copy));
  return copy;
}

struct Readable {
  Outcome<Database, Failure> database;
  std::string told;
};

// Reads what it can from a file that cannot be used itself, with a sentence about it.
Readable readableOf(const std::string& path, const Failure& why) {
  if (why.reason != Reason::newer_schema) return {copyOf(path), "What it has can be read"};
  const auto before = copyBefore(path);
  if (before.empty()) return {why, {}};
  const auto remedy = "To go on without it, put the copy " + before + " in the place of the file";
  if (!holdsSince(path, before)) return {why, remedy + ", with the results that were in force before"};
  auto copy = copyOf(before);
  if (!copy) return {why, "Neither can the copy of before: " + copy.error().what};
  return {std::move(copy), "Until then the results are those of before, of which all still hold. " + remedy};
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

Opened openToReadAlone(const std::string& path, const Failure& why) {
  auto [readable, told] = readableOf(path, why);
  if (!readable) told = "Nothing of it can be read" + (told.empty() ? "" : ". " + told);
  // Memory takes what a disk refuses: an empty store can be had in any case.
  Database database = readable ? std::move(readable).value() : Database::inMemory().value();
  (void)migrate(database);
  (void)checkRows(database);
  database.forbidWriting("nothing can be stored: " + why.what);
  return opened(std::move(database), "Nothing can be stored: " + why.what + ". " + told + ".");
}

}  // namespace probebox::store
