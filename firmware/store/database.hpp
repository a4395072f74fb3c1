#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <sqlite3.h>
#include <string>
#include <string_view>
#include <utility>

#include "firmware/store/failure.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::store {

// One file beside its journal, and every commit on the disk before it is acknowledged: results are few and dear.
inline constexpr const char* kDurable =
    "PRAGMA journal_mode = DELETE; PRAGMA synchronous = EXTRA; PRAGMA foreign_keys = ON";

// One connection to one SQLite file. Not thread-safe.
class Database {
 public:
  // Also provides row_sum(...) to SQL: a CRC-32C over all of its arguments and their types.
  static Outcome<Database, Failure> open(const std::string& path);
  // Never creates or changes a file.
  static Outcome<Database, Failure> openToRead(const std::string& path);
  static Outcome<Database, Failure> inMemory();

  // Refuses every later transaction with this reason.
  void forbidWriting(std::string why) { why_not_writable_ = std::move(why); }
  const std::string& whyNotWritable() const { return why_not_writable_; }

  Outcome<void, Failure> run(const char* sql);
  Outcome<std::int64_t, Failure> number(const char* sql);
  Outcome<std::string, Failure> text(const char* sql);

  // Replaces all that the other has, in one transaction.
  Outcome<void, Failure> copyInto(Database& other);

  std::int64_t lastId() const { return sqlite3_last_insert_rowid(handle_.get()); }
  bool readOnly() const { return sqlite3_db_readonly(handle_.get(), "main") == 1; }
  const std::string& path() const { return path_; }
  sqlite3* handle() { return handle_.get(); }

  // Describes the last call's error code for a person.
  Failure failure(int code) const;

 private:
  struct Close {
    void operator()(sqlite3* handle) const { sqlite3_close_v2(handle); }
  };
  Database(sqlite3* handle, std::string path) : handle_{handle}, path_{std::move(path)} {}

  static Outcome<Database, Failure> open(const std::string& path, int flags);

  std::unique_ptr<sqlite3, Close> handle_;
  std::string path_;
  std::string why_not_writable_;
};

// One prepared statement: bind from the left, step, read columns from the left.
class Statement {
 public:
  Statement(Database& database, std::string_view sql);

  Statement& bind(std::int64_t value);
  Statement& bind(std::string_view value);

  // Returns true when a row is available, false after the last row.
  Outcome<bool, Failure> step();
  // For a statement without rows.
  Outcome<void, Failure> run();
  // SQLite's code of the last call.
  int code() const { return code_; }
  // Begins once more, with other values to bind.
  Statement& again();

  std::int64_t number(int column) const { return sqlite3_column_int64(handle_.get(), column); }
  std::string text(int column) const;
  // Binds this row's value in the column to the next place of `other`.
  void copyTo(Statement& other, int column) const;

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* handle) const { sqlite3_finalize(handle); }
  };
  Database& database_;
  std::unique_ptr<sqlite3_stmt, Finalize> handle_;
  int code_{SQLITE_OK};
  int bound_{};
};

// Commits all changes since construction, or none.
class Transaction {
 public:
  static Outcome<Transaction, Failure> begin(Database& database);
  Transaction(Transaction&& other) noexcept : database_{std::exchange(other.database_, nullptr)} {}
  Transaction& operator=(Transaction&&) = delete;
  ~Transaction();

  Outcome<void, Failure> commit();

 private:
  explicit Transaction(Database& database) : database_{&database} {}
  Database* database_;
};

}  // namespace probebox::store
