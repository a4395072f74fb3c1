#pragma once
#include <cstddef>
#include <memory>
#include <span>
#include <string_view>

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
  virtual Transfer write(std::span<const std::byte> from) = 0;

  // Readable when read() has something.
  virtual int descriptor() const = 0;
  // Whether that descriptor is to be watched for writing as well while bytes wait to go out. False: it becomes readable
  // when there is room again.
  virtual bool watchedForWriting() const { return true; }
  virtual std::string_view name() const = 0;
};

// What one host and one box have between them. A carrier with frames of its own (USB) has a second lane for requests
// and answers, and its frames go bare; elsewhere `control` is null, and frames are delimited.
struct Connection {
  std::unique_ptr<BytePipe> data;
  std::unique_ptr<BytePipe> control;
};

}  // namespace probebox::io
