#pragma once
#include <cstddef>
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

  virtual int descriptor() const = 0;
  virtual std::string_view name() const = 0;
};

}  // namespace probebox::io
