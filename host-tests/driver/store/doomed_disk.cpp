#include "doomed_disk.hpp"

#include <algorithm>
#include <cstring>

namespace probebox::store {
namespace {

void land(std::vector<char>& content, const DoomedDisk::Change& change) {
  if (change.kind == DoomedDisk::Change::Kind::truncate) return content.resize(change.offset);
  content.resize(std::max(content.size(), change.offset + change.bytes.size()));
  std::ranges::copy(change.bytes, content.begin() + static_cast<std::ptrdiff_t>(change.offset));
}

// A write in pieces that the disk writes whole or not at all.
std::vector<DoomedDisk::Change> pieces(const DoomedDisk::Change& change, std::size_t sector) {
  if (change.kind == DoomedDisk::Change::Kind::truncate) return {change};
  std::vector<DoomedDisk::Change> all;
  for (std::size_t done = 0; done < change.bytes.size();) {
    const std::size_t at = change.offset + done;
    const std::size_t size = std::min(sector - at % sector, change.bytes.size() - done);
    const auto* first = change.bytes.data() + done;
    all.push_back({.kind = change.kind, .offset = at, .bytes = {first, first + size}});
    done += size;
  }
  return all;
}

struct Handle {
  sqlite3_file base;
  DoomedDisk* disk;
  DoomedDisk::File* file;
  DoomedDisk::File* own;  // of a temporary file without a name
  bool is_journal;
};

Handle& of(sqlite3_file* file) {
  return *reinterpret_cast<Handle*>(file);
}

}  // namespace

// What SQLite calls.
struct DoomedCalls {
  static DoomedDisk& disk(sqlite3_vfs* vfs) { return *static_cast<DoomedDisk*>(vfs->pAppData); }

  static int open(sqlite3_vfs* vfs, const char* name, sqlite3_file* base, int flags, int* flags_out) {
    static const sqlite3_io_methods methods = ioMethods();
    Handle& handle = of(base);
    handle = {};
    auto& own_disk = disk(vfs);
    if (const int error = own_disk.calling(SQLITE_IOERR); error != SQLITE_OK) return SQLITE_CANTOPEN;
    handle.disk = &own_disk;
    if (name == nullptr) {
      handle.own = handle.file = new DoomedDisk::File{};
    } else {
      auto& files = own_disk.files_;
      if (!files[name].now.exists) {
        if ((flags & SQLITE_OPEN_CREATE) == 0) return SQLITE_CANTOPEN;
        if (const int error = own_disk.changing(true); error != SQLITE_OK) return error;
        files[name].now = {.content = {}, .exists = true};
      }
      handle.file = &files[name];
    }
    handle.is_journal = (flags & SQLITE_OPEN_MAIN_JOURNAL) != 0;
    handle.base.pMethods = &methods;
    if (flags_out != nullptr) *flags_out = flags;
    return SQLITE_OK;
  }

  // Deleting is an entry of the directory: it may come back after a cut unless the directory was synced.
  static int remove(sqlite3_vfs* vfs, const char* name, int sync_directory) {
    auto& own_disk = disk(vfs);
    if (const int error = own_disk.calling(SQLITE_IOERR_DELETE); error != SQLITE_OK) return error;
    const auto found = own_disk.files_.find(name);
    if (found == own_disk.files_.end() || !found->second.now.exists) return SQLITE_IOERR_DELETE_NOENT;
    if (const int error = own_disk.changing(false); error != SQLITE_OK) return error;
    found->second.now = {};
    if (sync_directory != 0) found->second = {};
    return SQLITE_OK;
  }

  static int access(sqlite3_vfs* vfs, const char* name, int, int* result) {
    if (const int error = disk(vfs).calling(SQLITE_IOERR_ACCESS); error != SQLITE_OK) return error;
    const auto& files = disk(vfs).files_;
    const auto found = files.find(name);
    *result = found != files.end() && found->second.now.exists ? 1 : 0;
    return SQLITE_OK;
  }

  static int fullPath(sqlite3_vfs*, const char* name, int size, char* out) {
    sqlite3_snprintf(size, out, "%s", name);
    return SQLITE_OK;
  }
  static int randomness(sqlite3_vfs*, int size, char* out) {
    std::memset(out, 42, static_cast<std::size_t>(size));
    return size;
  }
  static int sleep(sqlite3_vfs*, int microseconds) { return microseconds; }
  static int time(sqlite3_vfs*, double* julian_day) {
    *julian_day = 2461000.5;
    return SQLITE_OK;
  }
  static int lastError(sqlite3_vfs*, int, char*) { return 0; }

  static int close(sqlite3_file* base) {
    delete of(base).own;
    return SQLITE_OK;
  }
  static int read(sqlite3_file* base, void* out, int amount, sqlite3_int64 offset) {
    if (const int error = of(base).disk->calling(SQLITE_IOERR_READ); error != SQLITE_OK) return error;
    const auto& content = of(base).file->now.content;
    const auto begin = std::min(static_cast<std::size_t>(offset), content.size());
    const auto size = std::min(static_cast<std::size_t>(amount), content.size() - begin);
    std::memset(out, 0, static_cast<std::size_t>(amount));
    if (size > 0) std::memcpy(out, content.data() + begin, size);
    return size == static_cast<std::size_t>(amount) ? SQLITE_OK : SQLITE_IOERR_SHORT_READ;
  }
  static int change(sqlite3_file* base, DoomedDisk::Change made, int error_code) {
    if (const int error = of(base).disk->calling(error_code); error != SQLITE_OK) return error;
    const bool is_write = made.kind == DoomedDisk::Change::Kind::write;
    if (const int error = of(base).disk->changing(is_write); error != SQLITE_OK) return error;
    land(of(base).file->now.content, made);
    of(base).file->since.push_back(std::move(made));
    return SQLITE_OK;
  }
  static int write(sqlite3_file* base, const void* bytes, int amount, sqlite3_int64 offset) {
    const auto* first = static_cast<const char*>(bytes);
    return change(base, {DoomedDisk::Change::Kind::write, static_cast<std::size_t>(offset), {first, first + amount}},
                  SQLITE_IOERR_WRITE);
  }
  static int truncate(sqlite3_file* base, sqlite3_int64 size) {
    return change(base, {DoomedDisk::Change::Kind::truncate, static_cast<std::size_t>(size), {}},
                  SQLITE_IOERR_TRUNCATE);
  }
  // As under Linux: the first sync of a journal also syncs its directory, and with it the database's own entry.
  static int sync(sqlite3_file* base, int) {
    auto& [ignored, own_disk, file, own, is_journal] = of(base);
    if (const int error = own_disk->calling(SQLITE_IOERR_FSYNC); error != SQLITE_OK) return error;
    if (const int error = own_disk->changing(false); error != SQLITE_OK) return error;
    file->synced.content = file->now.content;
    file->since.clear();
    if (!is_journal) return SQLITE_OK;
    for (auto& [name, other] : own_disk->files_) other.synced.exists = other.now.exists;
    return SQLITE_OK;
  }
  static int size(sqlite3_file* base, sqlite3_int64* out) {
    if (const int error = of(base).disk->calling(SQLITE_IOERR_FSTAT); error != SQLITE_OK) return error;
    *out = static_cast<sqlite3_int64>(of(base).file->now.content.size());
    return SQLITE_OK;
  }
  static int lock(sqlite3_file*, int) { return SQLITE_OK; }
  static int reserved(sqlite3_file*, int* out) {
    *out = 0;
    return SQLITE_OK;
  }
  static int control(sqlite3_file*, int, void*) { return SQLITE_NOTFOUND; }
  static int sector(sqlite3_file* base) { return of(base).disk->promises_.sector_bytes; }
  static int characteristics(sqlite3_file* base) {
    return of(base).disk->promises_.keeps_neighbours ? SQLITE_IOCAP_POWERSAFE_OVERWRITE : 0;
  }

  static sqlite3_io_methods ioMethods() {
    sqlite3_io_methods m{};
    m.iVersion = 1;
    m.xClose = close;
    m.xRead = read;
    m.xWrite = write;
    m.xTruncate = truncate;
    m.xSync = sync;
    m.xFileSize = size;
    m.xLock = lock;
    m.xUnlock = lock;
    m.xCheckReservedLock = reserved;
    m.xFileControl = control;
    m.xSectorSize = sector;
    m.xDeviceCharacteristics = characteristics;
    return m;
  }

  static void fill(sqlite3_vfs& vfs, DoomedDisk* owner) {
    vfs.iVersion = 1;
    vfs.szOsFile = sizeof(Handle);
    vfs.mxPathname = 512;
    vfs.zName = "doomed";
    vfs.pAppData = owner;
    vfs.xOpen = open;
    vfs.xDelete = remove;
    vfs.xAccess = access;
    vfs.xFullPathname = fullPath;
    vfs.xRandomness = randomness;
    vfs.xSleep = sleep;
    vfs.xCurrentTime = time;
    vfs.xGetLastError = lastError;
  }
};

DoomedDisk::DoomedDisk(Promises promises) : promises_{promises} {
  sqlite3_initialize();
  before_ = sqlite3_vfs_find(nullptr);
  DoomedCalls::fill(vfs_, this);
  sqlite3_vfs_register(&vfs_, 1);
}

DoomedDisk::~DoomedDisk() {
  sqlite3_vfs_unregister(&vfs_);
  sqlite3_vfs_register(before_, 1);
}

void DoomedDisk::failAt(std::size_t call, bool for_good) {
  fail_at_ = call;
  fails_for_good_ = for_good;
}

void DoomedDisk::repair() {
  power_off_at_.reset();
  full_at_.reset();
  fail_at_.reset();
  changes_ = calls_ = 0;
}

int DoomedDisk::calling(int error) {
  const std::size_t call = calls_++;
  if (power_off_at_ && changes_ > *power_off_at_) return error;
  if (!fail_at_) return SQLITE_OK;
  return call == *fail_at_ || (fails_for_good_ && call > *fail_at_) ? error : SQLITE_OK;
}

int DoomedDisk::changing(bool grows) {
  const std::size_t change = changes_++;
  if (power_off_at_ && change >= *power_off_at_) return SQLITE_IOERR;
  return grows && full_at_ && change >= *full_at_ ? SQLITE_FULL : SQLITE_OK;
}

void DoomedDisk::powerOn(Unsynced fate, std::uint64_t seed) {
  std::mt19937_64 random{seed};
  repair();
  for (auto entry = files_.begin(); entry != files_.end();) {
    File& file = entry->second;
    std::vector<char> content = file.synced.content;
    for (const auto& change : file.since) {
      if (fate == Unsynced::lost) break;
      for (const auto& piece : pieces(change, static_cast<std::size_t>(promises_.sector_bytes))) {
        if (fate == Unsynced::written || random() % 2 == 0) land(content, piece);
      }
    }
    // An entry that was made or deleted and not synced is there or not.
    const bool exists = fate == Unsynced::lost      ? file.synced.exists
                        : fate == Unsynced::written ? file.now.exists
                        : random() % 2 == 0         ? file.synced.exists
                                                    : file.now.exists;
    if (!exists) {
      entry = files_.erase(entry);
      continue;
    }
    file = {.now = {content, true}, .synced = {content, true}, .since = {}};
    ++entry;
  }
}

}  // namespace probebox::store
