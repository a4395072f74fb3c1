#include "firmware/store/database.hpp"

#include <utility>

namespace probebox::store {
namespace {

// Longer than any transaction of ours takes, shorter than a person waits.
constexpr int kBusyTimeout_ms = 2000;

Failure explain(int code, const std::string& path, const char* detail) {
  switch (code & 0xff) {
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return {Reason::unavailable,
              path + " is locked by another process; stop the other box that uses this state directory"};
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
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      return {Reason::damaged, path + " is damaged (" + detail + ")"};
    default:
      return {Reason::unavailable, path + ": " + detail};
  }
}

}  // namespace

Outcome<Database, Failure> Database::open(const std::string& path) {
  sqlite3* handle = nullptr;
  const int code = sqlite3_open_v2(path.c_str(), &handle, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, nullptr);
  Database database{handle, path};
  if (code != SQLITE_OK) return explain(code, path, sqlite3_errstr(code));
  sqlite3_busy_timeout(handle, kBusyTimeout_ms);
  return database;
}

Failure Database::failure(int code) const {
  return explain(code, path_, sqlite3_errmsg(handle_.get()));
}

Outcome<Done, Failure> Database::run(const char* sql) {
  const int code = sqlite3_exec(handle_.get(), sql, nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) return failure(code);
  return Done{};
}

Outcome<std::int64_t, Failure> Database::number(const char* sql) {
  Statement statement{*this, sql};
  const auto row = statement.step();
  if (!row) return row.error();
  return row.value() ? statement.number(0) : 0;
}

Outcome<std::string, Failure> Database::text(const char* sql) {
  Statement statement{*this, sql};
  const auto row = statement.step();
  if (!row) return row.error();
  return row.value() ? statement.text(0) : std::string{};
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

Statement& Statement::bind(double value) {
  if (code_ == SQLITE_OK) code_ = sqlite3_bind_double(handle_.get(), ++bound_, value);
  return *this;
}

Outcome<bool, Failure> Statement::step() {
  if (code_ == SQLITE_OK || code_ == SQLITE_ROW) code_ = sqlite3_step(handle_.get());
  if (code_ == SQLITE_ROW) return true;
  if (code_ == SQLITE_DONE) return false;
  return database_.failure(code_);
}

Outcome<Done, Failure> Statement::run() {
  const auto row = step();
  if (!row) return row.error();
  return Done{};
}

std::string Statement::text(int column) const {
  const auto* bytes = sqlite3_column_text(handle_.get(), column);
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(handle_.get(), column));
  return bytes == nullptr ? std::string{} : std::string{reinterpret_cast<const char*>(bytes), size};
}

Outcome<Transaction, Failure> Transaction::begin(Database& database) {
  // IMMEDIATE: the lock is taken now, so that a later statement cannot fail for want of it.
  if (const auto begun = database.run("BEGIN IMMEDIATE"); !begun) return begun.error();
  return Transaction{database};
}

Transaction::~Transaction() {
  if (database_ != nullptr) (void)database_->run("ROLLBACK");
}

Outcome<Done, Failure> Transaction::commit() {
  const auto committed = database_->run("COMMIT");
  if (committed) database_ = nullptr;
  return committed;
}

}  // namespace probebox::store
