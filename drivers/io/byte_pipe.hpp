#pragma once
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace probebox::io {

enum class PipeState { open, closed };

struct Transfer {
  std::size_t bytes{};  // bytes moved by this call; 0 while `open`: wait for the descriptor
  PipeState state{PipeState::open};
};

// A connected byte stream in both directions: serial line, TCP connection, pseudo terminal. Never blocks.
class BytePipe {
 public:
  virtual ~BytePipe() = default;

  virtual Transfer read(std::span<std::byte> into) = 0;
  // Bytes that read() would return next, without a copy, for carriers that buffer them; consume() releases them. Empty
  // when there are none, or when only read() can deliver them.
  virtual std::span<const std::byte> front() { return {}; }
  virtual void consume(std::size_t) {}
  virtual Transfer write(std::span<const std::byte> from) = 0;

  // Readable when read() has data.
  virtual int descriptor() const = 0;
  // True: also watch the descriptor for writing while bytes wait. False: it becomes readable when there is room again.
  virtual bool watchedForWriting() const { return true; }
  virtual std::string_view name() const = 0;
  // Who the peer has proved to be; nullopt where the carrier cannot tell, and until it has.
  virtual const std::optional<std::string>& person() const {
    static const std::optional<std::string> kNobody;
    return kNobody;
  }
  // After `closed`: why, with the remedy, where the carrier knows more than that it ended; else empty.
  virtual std::string_view whyClosed() const { return {}; }
};

// The connection between one host and one box. A carrier that neither loses nor damages bytes and has several channels
// (USB) has a second lane for requests and answers, and frames are sent bare; otherwise `control` is null and frames
// are delimited. The data lane's descriptor serves both.
struct Connection {
  Connection() = default;
  Connection(std::unique_ptr<BytePipe> data_lane, std::unique_ptr<BytePipe> control_lane = nullptr)
      : data{std::move(data_lane)}, control{std::move(control_lane)} {}

  std::unique_ptr<BytePipe> data;
  std::unique_ptr<BytePipe> control;
};

}  // namespace probebox::io
