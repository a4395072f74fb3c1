#pragma once
#include <cstddef>
#include <memory>
#include <span>
#include <string_view>
#include <utility>

namespace probebox::io {

enum class PipeState { open, closed };

struct Transfer {
  std::size_t bytes{};  // moved by this call; 0 with `open` means: nothing now, wait for the descriptor
  PipeState state{PipeState::open};
};

// A connected byte stream in both directions: a serial line, a TCP connection, a pseudo terminal. Never blocks.
class BytePipe {
 public:
  virtual ~BytePipe() = default;

  virtual Transfer read(std::span<std::byte> into) = 0;
  // What read() would give next where it lies, for carriers that keep it anyway; consume() what was taken of it.
  // Empty when there is nothing, or when bytes are to be had by read() only.
  virtual std::span<const std::byte> front() { return {}; }
  virtual void consume(std::size_t) {}
  virtual Transfer write(std::span<const std::byte> from) = 0;

  // Readable when read() has something.
  virtual int descriptor() const = 0;
  // Whether that descriptor is to be watched for writing as well while bytes wait to go out. False: it becomes readable
  // when there is room again.
  virtual bool watchedForWriting() const { return true; }
  virtual std::string_view name() const = 0;
};

// What one host and one box have between them. A carrier that neither loses nor damages bytes and has several ways
// through (USB) has a second lane for requests and answers, and frames go bare; elsewhere `control` is null, and frames
// are delimited. The descriptor of the data lane speaks for both.
struct Connection {
  Connection() = default;
  Connection(std::unique_ptr<BytePipe> data_lane, std::unique_ptr<BytePipe> control_lane = nullptr)
      : data{std::move(data_lane)}, control{std::move(control_lane)} {}

  std::unique_ptr<BytePipe> data;
  std::unique_ptr<BytePipe> control;
};

}  // namespace probebox::io
