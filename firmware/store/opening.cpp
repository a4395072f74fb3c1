#include "firmware/store/opening.hpp"

#include <filesystem>
#include <fstream>
#include <optional>
#include <sqlite3.h>
#include <system_error>

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

// SQLite only reads a file whose header has a write version that it does not know, as after damage of that byte
// (sqlite.org/fileformat.html, 1.3.3).
Failure whyReadOnly(const Database& database, const std::string& path) {
  constexpr std::streamoff kWriteVersion = 18;
  std::ifstream file{path, std::ios::binary};
  if (file.seekg(kWriteVersion).get() > 2) return {Reason::damaged, path + " is damaged (its header forbids writing)"};
  return database.failure(SQLITE_READONLY);
}

Outcome<Database, Failure> openSound(const std::string& path) {
  TRY(auto database, Database::open(path));
  TRY(inspect(database));
  if (database.readOnly()) return whyReadOnly(database, path);
  TRY(database.run(kDurable));
  TRY(makeTables(database));
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

// Makes PATH.new with all that is whole in the file, and closes it. Returns the number of results in it.
Outcome<std::size_t, Failure> makeNew(const std::string& path) {
  TRY(auto fresh, openSound(nameOfNew(path)));
  TRY(const auto salvaged, salvage(path, fresh));
  // A file with a good checksum may still contradict itself.
  TRY(checkRows(fresh));
  return salvaged;
}

std::string noticeOf(std::size_t salvaged, const std::string& what, const std::string& aside) {
  return what + "; it was moved to " + aside + ", and a new store was begun with " +
         (salvaged == 0 ? "nothing, because none of its results could be read"
                        : "the " + std::to_string(salvaged) + " results of it that are whole") +
         ": see what is in force, restore a backup, or calibrate again";
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
  TRY(auto fresh, openSound(path));
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
  if (whyNotOrdinary(path) || why.reason == Reason::other_schema) return {why, "Nothing of it can be read"};
  auto whole = copyOf(waitsForItsName(path) ? nameOfNew(path) : path);
  if (whole) return {std::move(whole), "What it has can be read"};
  auto part = salvagedInMemory(path);
  if (part) return {std::move(part), "What is whole in it can be read"};
  return {why, "Nothing of it can be read"};
}

// unreported: notice of what an earlier start has done to the file.
Outcome<Opened, Failure> openOrBeginAnew(const std::string& path, const std::string& unreported) {
  if (isEmptyFile(path)) return beginAnew(path, "empty", path + " was empty, with not even the head of a store");
  auto first = openSound(path);
  if (first) return opened(std::move(first).value(), unreported);
  if (first.error().reason == Reason::damaged) return beginAnew(path, "damaged", first.error().what);
  if (first.error().reason == Reason::foreign_file) return beginAnew(path, "foreign", first.error().what);
  return first.error();
}

}  // namespace

Outcome<Opened, Failure> openFile(const std::string& path) {
  if (auto why = whyNotOrdinary(path)) return *std::move(why);
  TRY(const auto unreported, finishReplacement(path));
  auto all = openOrBeginAnew(path, unreported);
  if (all) discardReplacement(path);
  return all;
}

Opened openToReadAlone(const std::string& path, const Failure& why) {
  auto [readable, told] = readableOf(path, why);
  // Memory takes what a disk refuses: an empty store can be had in any case.
  Database database = readable ? std::move(readable).value() : Database::inMemory().value();
  (void)makeTables(database);
  (void)checkRows(database);
  database.forbidWriting("nothing can be stored: " + why.what);
  return opened(std::move(database), "Nothing can be stored: " + why.what + ". " + told + ".");
}

}  // namespace probebox::store
