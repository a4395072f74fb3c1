#include "firmware/store/database.hpp"

#include <cstddef>
#include <utility>

#include "protocol/frame/crc32c.hpp"

namespace probebox::store {
namespace {

// Longer than any transaction of ours takes, shorter than a person waits.
constexpr int kBusyTimeout_ms = 2000;

Failure explain(int code, const std::string& path, const char* detail) {
  switch (code & 0xff) {
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return {Reason::unavailable, path +
                                       " is locked by another process: close the program that holds it (a backup, "
                                       "sqlite3, another box); a box that was started meanwhile is to be restarted"};
    case SQLITE_FULL:
      return {Reason::unavailable,
              path + " cannot grow: the disk is full; nothing was changed, free some space and repeat"};
    case SQLITE_READONLY:
      return {Reason::unavailable, path + " is read-only; make the file and its directory writable"};
    case SQLITE_CANTOPEN:
      return {Reason::unavailable, path + " cannot be opened; is its directory there, and may this user write to it?"};
    case SQLITE_PERM:
    case SQLITE_AUTH:
      return {Reason::unavailable, path + " may not be used by this user; change its owner or permissions"};
    case SQLITE_IOERR:
      return {Reason::unavailable,
              path + " cannot be read or written (" + detail + "); check the disk; nothing was changed"};
    // The statements are fixed, so tables that reject them are not as this program created them.
    case SQLITE_ERROR:
    case SQLITE_CONSTRAINT:
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      return {Reason::damaged, path + " is damaged (" + detail + ")"};
    default:
      return {Reason::unavailable, path + ": " + detail};
  }
}

// Lengths and types count as well: no text can move from one column to the next unnoticed.
void rowSum(sqlite3_context* context, int count, sqlite3_value** values) {
  std::uint32_t sum = 0;
  const auto add = [&sum](const void* bytes, std::size_t size) {
    sum = frame::crc32c({static_cast<const std::byte*>(bytes), size}, sum);
  };
  for (int i = 0; i < count; ++i) {
    const auto type = static_cast<std::uint8_t>(sqlite3_value_type(values[i]));
    add(&type, sizeof type);
    const auto* text = sqlite3_value_text(values[i]);
    const auto size = static_cast<std::uint32_t>(sqlite3_value_bytes(values[i]));
    add(&size, sizeof size);
    if (text != nullptr) add(text, size);
  }
  sqlite3_result_int64(context, sum);
}

}  // namespace

Outcome<Database, Failure> Database::open(const std::string& path) {
  return open(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
}

Outcome<Database, Failure> Database::openToRead(const std::string& path) {
  return open(path, SQLITE_OPEN_READONLY);
}

Outcome<Database, Failure> Database::inMemory() {
  return open(":memory:", SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
}

Outcome<Database, Failure> Database::open(const std::string& path, int flags) {
  sqlite3* handle = nullptr;
  const int code = sqlite3_open_v2(path.c_str(), &handle, flags, nullptr);
  Database database{handle, path};
  if (code != SQLITE_OK) return explain(code, path, sqlite3_errstr(code));
  sqlite3_busy_timeout(handle, kBusyTimeout_ms);
  constexpr int kAnyCount = -1;
  sqlite3_create_function(handle, "row_sum", kAnyCount, SQLITE_UTF8 | SQLITE_DETERMINISTIC, nullptr, &rowSum, nullptr,
                          nullptr);
  return database;
}

Failure Database::failure(int code) const {
  return explain(code, path_, sqlite3_errmsg(handle_.get()));
}

Outcome<void, Failure> Database::run(const char* sql) {
  const int code = sqlite3_exec(handle_.get(), sql, nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) return failure(code);
  return {};
}

Outcome<std::int64_t, Failure> Database::number(const char* sql) {
  Statement statement{*this, sql};
  TRY(const auto row, statement.step());
  return row ? statement.number(0) : 0;
}

Outcome<std::string, Failure> Database::text(const char* sql) {
  Statement statement{*this, sql};
  TRY(const auto row, statement.step());
  return row ? statement.text(0) : std::string{};
}

Outcome<void, Failure> Database::copyInto(Database& other) {
  auto* backup = sqlite3_backup_init(other.handle(), "main", handle(), "main");
  if (backup == nullptr) return other.failure(sqlite3_errcode(other.handle()));
  sqlite3_backup_step(backup, -1);
  if (const int code = sqlite3_backup_finish(backup); code != SQLITE_OK) return other.failure(code);
  return {};
}

Statement::Statement(Database& database, std::string_view sql) : database_{database} {
  sqlite3_stmt* handle = nullptr;
  code_ = sqlite3_prepare_v2(database.handle(), sql.data(), static_cast<int>(sql.size()), &handle, nullptr);
  handle_.reset(handle);
}

Statement& Statement::bind(std::int64_t value) {
  if (code_ == SQLITE_OK) code_ = sqlite3_bind_int64(handle_.get(), ++bound_, value);
  return *this;
}

Statement& Statement::bind(std::string_view value) {
  if (code_ == SQLITE_OK) {
    // An empty text is not NULL, and SQLite keeps its own copy: the caller's text may be gone before step().
    const char* bytes = value.empty() ? "" : value.data();
    code_ = sqlite3_bind_text64(handle_.get(), ++bound_, bytes, value.size(), SQLITE_TRANSIENT, SQLITE_UTF8);
  }
  return *this;
}

Outcome<bool, Failure> Statement::step() {
  if (code_ == SQLITE_OK || code_ == SQLITE_ROW) code_ = sqlite3_step(handle_.get());
  if (code_ == SQLITE_ROW) return true;
  if (code_ == SQLITE_DONE) return false;
  return database_.failure(code_);
}

Outcome<void, Failure> Statement::run() {
  TRY(step());
  return {};
}

Statement& Statement::again() {
  if (!handle_) return *this;  // what it could not be prepared for stands
  sqlite3_reset(handle_.get());
  bound_ = 0;
  code_ = SQLITE_OK;
  return *this;
}

std::string Statement::text(int column) const {
  const auto* bytes = sqlite3_column_text(handle_.get(), column);
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(handle_.get(), column));
  return bytes == nullptr ? std::string{} : std::string{reinterpret_cast<const char*>(bytes), size};
}

void Statement::copyTo(Statement& other, int column) const {
  if (other.code_ == SQLITE_OK)
    other.code_ = sqlite3_bind_value(other.handle_.get(), ++other.bound_, sqlite3_column_value(handle_.get(), column));
}

Outcome<Transaction, Failure> Transaction::begin(Database& database) {
  if (!database.whyNotWritable().empty()) return Failure{Reason::unavailable, database.whyNotWritable()};
  // IMMEDIATE: the lock is taken now, so that a later statement cannot fail for want of it.
  TRY(database.run("BEGIN IMMEDIATE"));
  return Transaction{database};
}

Transaction::~Transaction() {
  if (database_ != nullptr) (void)database_->run("ROLLBACK");
}

Outcome<void, Failure> Transaction::commit() {
  const auto committed = database_->run("COMMIT");
  if (committed) database_ = nullptr;
  return committed;
}

}  // namespace probebox::store
