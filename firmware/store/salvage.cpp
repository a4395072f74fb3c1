#include "firmware/store/salvage.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <string_view>

#include "firmware/store/schema.hpp"

namespace probebox::store {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kMostIds = 100'000;  // a number beyond it is damage itself

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
    Table{"standing", "id", "id, x_mm, y_mm, z_mm, utc", 5},
};

// The copy that is worked on, gone afterwards.
class WorkingCopy {
 public:
  explicit WorkingCopy(const std::string& damaged) : path_{damaged + ".salvage"} {
    std::error_code ignored;
    fs::copy_file(damaged, path_, fs::copy_options::overwrite_existing, ignored);
    fs::copy_file(damaged + "-journal", path_ + "-journal", fs::copy_options::overwrite_existing, ignored);
  }
  ~WorkingCopy() {
    std::error_code ignored;
    for (const char* companion : {"", "-journal", "-wal", "-shm"}) fs::remove(path_ + companion, ignored);
  }
  WorkingCopy(const WorkingCopy&) = delete;
  WorkingCopy& operator=(const WorkingCopy&) = delete;

  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

// Restores the header that SQLite writes into each of our files (sqlite.org/fileformat.html, 1.3): one damaged byte of
// it hides all rows.
void makeHeaderGood(const std::string& path) {
  constexpr std::size_t kPage = 4096;
  std::error_code error;
  const auto size = fs::file_size(path, error);
  if (error || size < kPage) return;
  std::fstream file{path, std::ios::binary | std::ios::in | std::ios::out};
  std::array<char, 100> header{};
  file.read(header.data(), header.size());
  const auto put = [&header](std::size_t at, std::string_view bytes) {
    std::copy(bytes.begin(), bytes.end(), header.begin() + static_cast<std::ptrdiff_t>(at));
  };
  const auto put32 = [&header](std::size_t at, std::uint32_t value) {
    for (std::size_t i = 0; i < 4; ++i) header[at + i] = static_cast<char>(value >> (24 - 8 * i));
  };
  put(0, std::string_view{"SQLite format 3\0", 16});
  put(16, std::string_view{"\x10\x00\x01\x01\x00\x40\x20\x20", 8});  // 4096 bytes a page, rollback journal
  put32(28, static_cast<std::uint32_t>(size / kPage));
  put32(44, 4);  // schema format
  put32(52, 0);  // no auto-vacuum
  put32(56, 1);  // UTF-8
  put32(60, static_cast<std::uint32_t>(knownSchema()));
  put32(64, 0);
  put32(68, static_cast<std::uint32_t>(kApplicationId));
  put(72, std::string_view{"\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0", 20});
  std::copy_n(header.begin() + 24, 4, header.begin() + 92);  // the number of pages holds for this change
  file.seekp(0);
  file.write(header.data(), header.size());
}

// From both ends: what lies behind a page that cannot be read is reached from the other side.
std::set<std::int64_t> idsOf(Database& from, const Table& table) {
  std::set<std::int64_t> ids;
  std::int64_t greatest = 0;
  for (const char* direction : {"ASC", "DESC"}) {
    Statement rows{
        from, std::string{"SELECT "} + table.id + " FROM " + table.name + " ORDER BY " + table.id + " " + direction};
    while (ids.size() < static_cast<std::size_t>(kMostIds)) {
      const auto row = rows.step();
      if (!row || !row.value()) break;
      ids.insert(rows.number(0));
      greatest = std::max(greatest, rows.number(0));
    }
  }
  // And one by one between: a page in the middle hides its own rows alone.
  for (std::int64_t id = 1; id <= std::min(greatest, kMostIds); ++id) ids.insert(id);
  return ids;
}

// Copies rows of one table that are whole. A damaged number can make it try all up to kMostIds, so its statements are
// prepared once.
class Copier {
 public:
  Copier(Database& from, Database& into, const Table& table)
      : table_{table},
        row_{from, "SELECT " + std::string{table.columns} + ", checksum FROM " + table.name + " WHERE " + table.id +
                       " = ? AND checksum = row_sum(" + table.columns + ")"},
        insert_{into, std::string{"INSERT OR IGNORE INTO "} + table.name + " (" + table.columns +
                          ", checksum) VALUES (" + places(table.count + 1) + ")"} {}

  bool copies(std::int64_t id) {
    const auto found = row_.again().bind(id).step();
    if (!found || !found.value()) return false;
    insert_.again();
    for (int i = 0; i <= table_.count; ++i) row_.copyTo(insert_, i);
    return insert_.run().ok();
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

}  // namespace

std::size_t salvage(const std::string& damaged, Database& into) {
  const WorkingCopy copy{damaged};
  if (std::error_code error; !fs::exists(copy.path() + "-journal", error)) makeHeaderGood(copy.path());
  auto from = Database::open(copy.path());
  if (!from || !into.run("PRAGMA foreign_keys = OFF")) return 0;
  std::size_t results = 0;
  {
    auto transaction = Transaction::begin(into);
    if (!transaction) return 0;
    for (const auto& table : kTables) {
      Copier copier{*from, into, table};
      for (const auto id : idsOf(*from, table)) {
        if (copier.copies(id) && &table == kTables.data()) ++results;
      }
    }
    // The numbers of what was lost are not given again.
    if (const auto last = from->number("SELECT seq FROM sqlite_sequence WHERE name = 'results'");
        last && last.value() > 0 && last.value() <= kMostIds) {
      (void)into.run(
          "INSERT INTO sqlite_sequence (name, seq) SELECT 'results', 0 WHERE NOT EXISTS "
          "(SELECT 1 FROM sqlite_sequence WHERE name = 'results')");
      const std::string keep =
          "UPDATE sqlite_sequence SET seq = max(seq, " + std::to_string(last.value()) + ") WHERE name = 'results'";
      (void)into.run(keep.c_str());
    }
    if (!transaction->commit()) results = 0;
  }
  (void)into.run("PRAGMA foreign_keys = ON");
  return results;
}

}  // namespace probebox::store
