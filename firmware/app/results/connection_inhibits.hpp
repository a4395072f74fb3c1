#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/app/results/cut_lock.hpp"
#include "firmware/store/twin_file.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// Lasting state of one connection: a line of the CNC ("modbus:/dev/ttyS2"), a link of hosts ("serial:/dev/ttyS1",
// "usb", "tcp:127.0.0.1:7627"), or a person ("person:Ada").
struct ConnectionEntry {
  std::string connection{};
  std::uint16_t word_order{};  // of a Modbus line, as register 128 has it
  bool inhibits{};             // declares that a cut is on
  std::string by{};            // who declared it last; empty for a controller
  std::string since_utc{};     // ISO 8601
  static constexpr void fields(auto& self, auto&& field) {
    field("connection", self.connection, "");
    field("word_order", self.word_order, "");
    field("inhibits", self.inhibits, "");
    field("by", self.by, "");
    field("since_utc", self.since_utc, "");
  }
};

// Stores the choices of each connection on disk before they are acknowledged, and informs the core whether any
// connection declares a cut. Any thread; each call may wait for the disk.
class ConnectionInhibits {
 public:
  static constexpr std::size_t kMostConnections = 32;  // lines and links
  static constexpr std::size_t kMostPersons = 8;       // in places of their own: names cannot keep a line from a cut
  static constexpr std::size_t kMostName = 80;         // bytes of a connection's or a person's name

  // tell_core: passes on whether any connection inhibits; false when the core's queue is full.
  ConnectionInhibits(const std::string& path, std::function<bool(bool)> tell_core,
                     store::Before before = store::Before::perhaps);

  // Problem with the file, for a person; empty without one.
  std::string problem() const;

  std::uint16_t wordOrder(std::string_view connection) const;
  std::optional<Error> keepWordOrder(std::string_view connection, std::uint16_t order);

  bool inhibits(std::string_view connection) const;
  bool anyInhibits() const;
  std::vector<ConnectionEntry> holders() const;
  // Keeps all connections from changing while a result comes into force; nothing while one inhibits, or waits to do so.
  // May wait for the disk.
  std::optional<CutLock> tryLockOutCuts();

  // Declares that a cut is on, or over; returns at once when that is stored and with the core already, and waits for a
  // result that is just coming into force, 2 s at most. On a failure of the disk the begin of a cut holds until the box
  // ends, and the error says so; the end of a cut is not accepted.
  std::optional<Error> setInhibit(std::string_view connection, bool active, std::string_view by);
  // Clears the inhibit of another connection in the name of a person, such as for a controller that is gone.
  std::optional<Error> clearInhibit(std::string_view connection, std::string_view by);

 private:
  using Connections = std::vector<ConnectionEntry>;
  std::optional<Error> store(const Connections& connections);
  std::optional<Error> change(std::string_view connection, bool active, std::string_view by);
  std::optional<Error> tellCore();
  void show(Connections connections);
  bool isStored(std::string_view connection) const;

  std::function<bool(bool)> tell_core_;
  std::atomic<int> declaring_{};  // connections whose inhibit waits for changing_
  std::timed_mutex changing_;     // held while connections_ changes and the disk writes, or a result comes into force
  store::TwinFile file_;
  mutable std::mutex mutex_;  // never held for long
  Connections connections_;
  Connections stored_;                         // what was written last
  std::set<std::string, std::less<>> unsure_;  // connections of which the file may have something else
  bool unreported_{};                          // the core has not taken the last change
  std::string problem_;
};

}  // namespace probebox::app
