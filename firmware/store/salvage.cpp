#include "firmware/store/salvage.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <set>
#include <sqlite3.h>
#include <string_view>

#include "firmware/store/replacement.hpp"
#include "firmware/store/rows.hpp"
#include "firmware/store/schema.hpp"
#include "firmware/store/set_aside.hpp"

namespace probebox::store {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPage = 4096;

// The greatest number of a row that a file of this size can have; a number beyond it is damage itself. Rows are never
// deleted, and none takes less than 20 bytes; some of the rows may have been lost.
std::int64_t mostIdsIn(std::uint64_t file_bytes) {
  return static_cast<std::int64_t>(std::max<std::uint64_t>(100'000, file_bytes / 20));
}

// 0 where nobody can say.
std::uint64_t bytesOf(const std::string& path) {
  std::error_code error;
  const auto size = fs::file_size(path, error);
  return error ? 0 : size;
}

struct Table {
  const char* name;
  const char* id;
  const char* columns;  // all but the checksum, in the order in which it is made
  int count;
};

constexpr std::array kTables{
    Table{"results", "id",
          "id, state, method, subject, probe, machine, mounting, result_json, proposed_utc, accepted_utc, accepted_by, "
          "retired_utc",
          12},
    Table{"transitions", "id", "id, result_id, state, utc, by_whom", 5},
    Table{"datasets", "result_id", "result_id, json", 2},
    Table{"dependences", "id", "id, result_id, rests_on", 3},
    Table{"remarks", "transition_id", "transition_id, text", 2},
};

// The copy that is worked on, gone afterwards.
class WorkingCopy {
 public:
  explicit WorkingCopy(const std::string& damaged) : path_{nameOfSalvage(damaged)} {
    copy(damaged, path_);
    if (isThere(damaged + "-journal")) copy(damaged + "-journal", path_ + "-journal");
  }
  ~WorkingCopy() {
    std::error_code ignored;
    for (const char* companion : {"", "-journal", "-wal", "-shm"}) fs::remove(path_ + companion, ignored);
  }
  WorkingCopy(const WorkingCopy&) = delete;
  WorkingCopy& operator=(const WorkingCopy&) = delete;

  const std::string& path() const { return path_; }
  bool hasJournal() const { return isThere(path_ + "-journal"); }
  // Empty when the copy is whole.
  const std::string& whyNot() const { return why_not_; }

 private:
  void copy(const std::string& from, const std::string& to) {
    std::error_code error;
    fs::copy_file(from, to, fs::copy_options::overwrite_existing, error);
    if (error) why_not_ = from + " cannot be copied to " + to + " (" + error.message() + ")";
  }

  std::string path_;
  std::string why_not_;
};

using Header = std::array<char, 100>;

// Restores the header that SQLite writes into each of our files (sqlite.org/fileformat.html, 1.3): one damaged byte of
// it hides all rows. file_bytes: size of the file.
void makeGood(Header& header, std::uint64_t file_bytes) {
  const auto put = [&header](std::size_t at, std::string_view bytes) {
    std::copy(bytes.begin(), bytes.end(), header.begin() + static_cast<std::ptrdiff_t>(at));
  };
  const auto put32 = [&header](std::size_t at, std::uint32_t value) {
    for (std::size_t i = 0; i < 4; ++i) header[at + i] = static_cast<char>(value >> (24 - 8 * i));
  };
  put(0, std::string_view{"SQLite format 3\0", 16});
  put(16, std::string_view{"\x10\x00\x01\x01\x00\x40\x20\x20", 8});  // 4096 bytes a page, rollback journal
  put32(28, static_cast<std::uint32_t>(file_bytes / kPage));
  put32(44, 4);  // schema format
  put32(52, 0);  // no auto-vacuum
  put32(56, 1);  // UTF-8
  put32(60, static_cast<std::uint32_t>(kSchema));
  put32(64, 0);
  put32(68, static_cast<std::uint32_t>(kApplicationId));
  put(72, std::string_view{"\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0", 20});
  std::copy_n(header.begin() + 24, 4, header.begin() + 92);  // the number of pages holds for this change
}

// False when the file cannot be changed.
bool makeHeaderGood(const std::string& path) {
  std::error_code error;
  const auto size = fs::file_size(path, error);
  if (error || size < kPage) return !error;
  std::fstream file{path, std::ios::binary | std::ios::in | std::ios::out};
  Header header{};
  file.read(header.data(), header.size());
  makeGood(header, size);
  file.seekp(0);
  file.write(header.data(), header.size());
  file.close();
  return file.good();
}

// The last call failed for want of the disk, not for what the file has in it.
bool wasTheDisk(const Statement& statement) {
  switch (statement.code() & 0xff) {
    case SQLITE_IOERR:
    case SQLITE_FULL:
    case SQLITE_NOMEM:
    case SQLITE_CANTOPEN:
    case SQLITE_READONLY:
    case SQLITE_BUSY:
      return true;
    default:
      return false;
  }
}

// From both ends: what lies behind a page that cannot be read is reached from the other side.
Outcome<std::set<std::int64_t>, Failure> idsOf(Database& from, const Table& table, std::int64_t most) {
  std::set<std::int64_t> ids;
  std::int64_t greatest = 0;
  for (const char* direction : {"ASC", "DESC"}) {
    Statement rows{
        from, std::string{"SELECT "} + table.id + " FROM " + table.name + " ORDER BY " + table.id + " " + direction};
    for (std::int64_t count = 0; count < most; ++count) {
      const auto row = rows.step();
      if (!row && wasTheDisk(rows)) return row.error();
      if (!row || !row.value()) break;
      ids.insert(rows.number(0));
      greatest = std::max(greatest, rows.number(0));
    }
  }
  // And one by one between: a page in the middle hides its own rows alone.
  for (std::int64_t id = 1; id <= std::min(greatest, most); ++id) ids.insert(id);
  return ids;
}

// Copies rows of one table that are whole. A damaged number can make it try all up to the greatest, so its statements
// are prepared once.
class Copier {
 public:
  Copier(Database& from, Database& into, const Table& table)
      : table_{table},
        row_{from, "SELECT " + std::string{table.columns} + ", checksum FROM " + table.name + " WHERE " + table.id +
                       " = ? AND checksum = row_sum(" + table.columns + ")"},
        insert_{into, std::string{"INSERT OR IGNORE INTO "} + table.name + " (" + table.columns +
                          ", checksum) VALUES (" + places(table.count + 1) + ")"} {}

  // False: there is no such row, or it is damaged.
  Outcome<bool, Failure> copies(std::int64_t id) {
    const auto found = row_.again().bind(id).step();
    if (!found && wasTheDisk(row_)) return found.error();
    if (!found || !found.value()) return false;
    insert_.again();
    for (int i = 0; i <= table_.count; ++i) row_.copyTo(insert_, i);
    const auto inserted = insert_.run();
    if (!inserted && wasTheDisk(insert_)) return inserted.error();
    return inserted.ok();
  }

 private:
  static std::string places(int count) {
    std::string all = "?";
    for (int i = 1; i < count; ++i) all += ", ?";
    return all;
  }

  const Table& table_;
  Statement row_;
  Statement insert_;
};

// The numbers of what was lost are not given again.
Outcome<void, Failure> keepLastNumber(Database& from, Database& into, std::int64_t most) {
  const auto last = from.number("SELECT seq FROM sqlite_sequence WHERE name = 'results'");
  if (!last && last.error().reason == Reason::unavailable) return last.error();
  if (!last || *last <= 0 || *last > most) return {};
  TRY(
      into.run("INSERT INTO sqlite_sequence (name, seq) SELECT 'results', 0 WHERE NOT EXISTS "
               "(SELECT 1 FROM sqlite_sequence WHERE name = 'results')"));
  const std::string keep =
      "UPDATE sqlite_sequence SET seq = max(seq, " + std::to_string(*last) + ") WHERE name = 'results'";
  return into.run(keep.c_str());
}

// All in one transaction.
Outcome<std::size_t, Failure> copyWhatIsWhole(Database& from, std::uint64_t file_bytes, Database& into) {
  const auto most = mostIdsIn(file_bytes);
  std::size_t salvaged = 0;
  TRY(into.run("PRAGMA foreign_keys = OFF"));
  {
    TRY(auto transaction, Transaction::begin(into));
    for (const auto& table : kTables) {
      Copier copier{from, into, table};
      TRY(const auto ids, idsOf(from, table, most));
      for (const auto id : ids) {
        TRY(const auto copied, copier.copies(id));
        if (copied && &table == kTables.data()) ++salvaged;
      }
    }
    TRY(keepLastNumber(from, into, most));
    TRY(markDamaged(into));
    TRY(transaction.commit());
  }
  TRY(into.run("PRAGMA foreign_keys = ON"));
  return salvaged;
}

// The bytes of a file as a database in memory, its header repaired.
Outcome<Database, Failure> imageOf(const std::string& path) {
  const Failure unreadable{Reason::unavailable, path + " cannot be read"};
  std::error_code error;
  const auto size = fs::file_size(path, error);
  std::ifstream file{path, std::ios::binary};
  if (error || size < kPage || !file) return unreadable;
  TRY(auto database, Database::inMemory());
  auto* const bytes = static_cast<char*>(sqlite3_malloc64(size));
  if (bytes == nullptr || !file.read(bytes, static_cast<std::streamsize>(size))) {
    sqlite3_free(bytes);
    return unreadable;
  }
  Header header{};
  std::copy_n(bytes, header.size(), header.begin());
  makeGood(header, size);
  std::copy(header.begin(), header.end(), bytes);
  const auto length = static_cast<sqlite3_int64>(size);
  // Frees the bytes in any case.
  const int code = sqlite3_deserialize(database.handle(), "main", reinterpret_cast<unsigned char*>(bytes), length,
                                       length, SQLITE_DESERIALIZE_FREEONCLOSE | SQLITE_DESERIALIZE_READONLY);
  if (code != SQLITE_OK) return database.failure(code);
  return database;
}

}  // namespace

Outcome<std::size_t, Failure> salvage(const std::string& damaged, Database& into) {
  const WorkingCopy copy{damaged};
  if (!copy.whyNot().empty()) return Failure{Reason::unavailable, copy.whyNot()};
  if (!copy.hasJournal() && !makeHeaderGood(copy.path()))
    return Failure{Reason::unavailable, copy.path() + " cannot be written; check the disk"};
  TRY(auto from, Database::open(copy.path()));
  // Nobody else reads the copy: one lock for all rows, of which a damaged number can make a hundred thousand.
  static_cast<void>(from.run("PRAGMA locking_mode = EXCLUSIVE"));
  return copyWhatIsWhole(from, bytesOf(copy.path()), into);
}

Outcome<Database, Failure> salvagedInMemory(const std::string& damaged) {
  const Failure nothing{Reason::damaged, damaged + " is damaged, and nothing of it is whole"};
  if (std::error_code error; fs::file_size(damaged + "-journal", error) > 0 && !error) return nothing;
  TRY(auto from, imageOf(damaged));
  TRY(auto into, Database::inMemory());
  TRY(makeTables(into));
  TRY(const auto salvaged, copyWhatIsWhole(from, bytesOf(damaged), into));
  if (salvaged == 0) return nothing;
  return into;
}

}  // namespace probebox::store
