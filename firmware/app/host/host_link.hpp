#pragma once
#include <cstdint>

#include "drivers/io/byte_pipe.hpp"
#include "firmware/stream/session.hpp"
#include "protocol/units/time.hpp"

namespace probebox::app {

// Moves bytes between a connection and its session, on one lane or two.
class HostLink {
 public:
  // options.two_lanes is set from the connection.
  HostLink(std::uint64_t id, io::Connection connection, stream::SessionOptions options, const stream::History& history);

  std::uint64_t id() const { return id_; }
  stream::Session& session() { return session_; }
  const stream::Session& session() const { return session_; }
  int descriptor() const { return connection_.data->descriptor(); }

  // Receives a bounded amount, so that one host cannot delay the others.
  void receive(MonoTime now);
  // Sends as much as the connection takes.
  void flush();

  // True after the connection has ended or hangUp() was called.
  bool closed() const { return connection_.data == nullptr; }
  // After flush(): true when the descriptor must be watched for writing.
  bool waitsForWriting() const { return waits_for_writing_; }
  void hangUp();

 private:
  bool receive(io::BytePipe& pipe, stream::Lane lane, MonoTime now);
  bool flush(io::BytePipe& pipe, stream::Lane lane);

  std::uint64_t id_;
  io::Connection connection_;
  stream::Session session_;
  bool waits_for_writing_{};
};

}  // namespace probebox::app
