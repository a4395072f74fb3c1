#pragma once
#include <cstdint>

#include "drivers/io/byte_pipe.hpp"
#include "firmware/stream/session.hpp"
#include "protocol/units/time.hpp"

namespace probebox::app {

// A connection and the session that speaks over it: moves bytes between the two, on one lane or on both.
class HostLink {
 public:
  // options.two_lanes is set from the connection.
  HostLink(std::uint64_t id, io::Connection connection, stream::SessionOptions options, const stream::History& history,
           MonoTime now);

  std::uint64_t id() const { return id_; }
  MonoTime since() const { return since_; }
  stream::Session& session() { return session_; }
  const stream::Session& session() const { return session_; }
  int descriptor() const { return connection_.data->descriptor(); }

  // What has come, up to a bounded amount: a host that talks without end does not keep the others waiting.
  void receive(MonoTime now);
  // As much as the connection takes.
  void flush();

  // The connection has ended, or hangUp() was called.
  bool closed() const { return connection_.data == nullptr; }
  // After flush(): whether the descriptor is to be watched for writing.
  bool waitsForWriting() const { return waits_for_writing_; }
  void hangUp();

 private:
  bool receive(io::BytePipe& pipe, stream::Lane lane, MonoTime now);
  bool flush(io::BytePipe& pipe, stream::Lane lane);

  std::uint64_t id_;
  io::Connection connection_;
  stream::Session session_;
  MonoTime since_;
  bool waits_for_writing_{};
};

}  // namespace probebox::app
