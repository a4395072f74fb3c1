#include "firmware/store/opening.hpp"

#include <filesystem>
#include <fstream>
#include <optional>
#include <sqlite3.h>
#include <system_error>

#include "firmware/store/copy_before.hpp"
#include "firmware/store/replacement.hpp"
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

// SQLite only reads a file whose header has a write version that it does not know, as after damage of that byte
// (sqlite.org/fileformat.html, 1.3.3).
Failure whyReadOnly(const Database& database, const std::string& path) {
  constexpr std::streamoff kWriteVersion = 18;
  std::ifstream file{path, std::ios::binary};
  if (file.seekg(kWriteVersion).get() > 2) return {Reason::damaged, path + " is damaged (its header forbids writing)"};
  return database.failure(SQLITE_READONLY);
}

// notice: what was done to an older file that a person should know; or empty.
Outcome<Database, Failure> openSound(const std::string& path, std::string& notice) {
  TRY(auto database, Database::open(path));
  TRY(inspect(database));
  if (database.readOnly()) return whyReadOnly(database, path);
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

// Who opens a pipe waits for its other end.
std::optional<Failure> whyNotOrdinary(const std::string& path) {
  for (const auto& name : {path, path + "-journal"}) {
    if (!isOrdinaryOrAbsent(name))
      return Failure{Reason::unavailable, name + " is no ordinary file: remove it, and restart the box"};
  }
  return std::nullopt;
}

// SQLite takes a file of nothing for a new one; it was one of results, or the disk has lost it.
bool isEmptyFile(const std::string& path) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  return !error && size == 0;
}

// Makes PATH.new with all that is whole in the file, and closes it.
Outcome<Salvaged, Failure> makeNew(const std::string& path) {
  std::string none;
  TRY(auto fresh, openSound(nameOfNew(path), none));
  TRY(auto salvaged, salvage(path, fresh));
  // A file with a good checksum may still contradict itself.
  TRY(checkRows(fresh));
  return salvaged;
}

std::string noticeOf(const Salvaged& salvaged, const std::string& what, const std::string& aside) {
  return what + "; it was moved to " + aside + ", and a new store was begun with " +
         (salvaged.results == 0 ? "nothing, because none of its results could be read"
                                : "the " + std::to_string(salvaged.results) + " results of it that are whole") +
         ": see what is in force, restore a backup, or calibrate again" +
         (salvaged.assigned.empty() ? "" : ". " + salvaged.assigned);
}

// Returns the notice.
Outcome<std::string, Failure> replaceUnusable(const std::string& path, const std::string& reason,
                                              const std::string& what) {
  discardReplacement(path);
  TRY(const auto salvaged, makeNew(path));
  const auto aside = asideNameOf(path, reason);
  auto notice = noticeOf(salvaged, what, aside);
  TRY(replaceByNew(path, aside, notice));
  return notice;
}

// Makes a new store of what is whole, and puts the file aside. On an error the file is where it was.
Outcome<Opened, Failure> beginAnew(const std::string& path, const std::string& reason, const std::string& what) {
  auto notice = replaceUnusable(path, reason, what);
  if (!notice) {
    if (isThere(nameOfNew(path))) discardReplacement(path);  // else the next start tells what was done
    return Failure{Reason::unavailable, what + ", and cannot be replaced by a new store: " + notice.error().what};
  }
  std::string migrated;
  TRY(auto fresh, openSound(path, migrated));
  return opened(std::move(fresh), std::move(notice).value());
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
  if (whyNotOrdinary(path)) return {why, {}};
  if (why.reason != Reason::newer_schema) {
    auto whole = copyOf(waitsForItsName(path) ? nameOfNew(path) : path);
    if (whole) return {std::move(whole), "What it has can be read"};
    auto part = salvagedInMemory(path);
    if (part) return {std::move(part), "What is whole in it can be read"};
    return {why, {}};
  }
  const auto before = copyBefore(path);
  if (before.empty()) return {why, {}};
  const auto remedy = "To go on without it, put the copy " + before + " in the place of the file";
  if (!holdsSince(path, before)) return {why, remedy + ", with the results that were in force before"};
  auto copy = copyOf(before);
  if (!copy) return {why, "Neither can the copy of before: " + copy.error().what};
  return {std::move(copy), "Until then the results are those of before, of which all still hold. " + remedy};
}

// untold: notice of what an earlier start has done to the file.
Outcome<Opened, Failure> openOrBeginAnew(const std::string& path, const std::string& untold) {
  if (isEmptyFile(path)) return beginAnew(path, "empty", path + " was empty, with not even the head of a store");
  std::string notice;
  auto first = openSound(path, notice);
  if (first) {
    const std::string between = untold.empty() || notice.empty() ? "" : ". ";
    return opened(std::move(first).value(), untold + between + notice);
  }
  if (first.error().reason == Reason::damaged) return beginAnew(path, "damaged", first.error().what);
  if (first.error().reason == Reason::foreign_file) return beginAnew(path, "foreign", first.error().what);
  return first.error();
}

}  // namespace

Outcome<Opened, Failure> openFile(const std::string& path) {
  if (auto why = whyNotOrdinary(path)) return *std::move(why);
  TRY(const auto untold, finishReplacement(path));
  auto all = openOrBeginAnew(path, untold);
  if (all) discardReplacement(path);
  return all;
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
