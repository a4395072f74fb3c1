#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "firmware/modbus/register_image.hpp"
#include "firmware/modbus/rtu_requests.hpp"
#include "firmware/modbus/writable_registers.hpp"
#include "protocol/state/snapshot.hpp"

namespace probebox::app {

// Answers requests to the register map, whichever way they come. One thread.
class RegisterHandler {
 public:
  // Choices of a master that survive a restart of the box and an unplugged adapter.
  struct Kept {
    modbus::WordOrder word_order{};
    bool inhibits{};
  };
  // All of these are called inside answer(), on its thread.
  struct Callbacks {
    std::function<published::Snapshot()> snapshot;  // for the next answer
    // What a reader may see of it; called before serves(). Null: all of it.
    std::function<published::Snapshot(std::string_view reader, const published::Snapshot&)> shown_to{};
    std::function<bool(std::span<const Event>)> take;  // events of a write, without stamps; false refuses all of them
    std::function<Kept()> kept;                        // choices in force
    std::function<bool(modbus::WordOrder)> keep{};     // stores a choice; true: it is on the disk. Null: it is fixed
    std::function<published::LineState(const published::Snapshot&)> line{};  // further values of the same answer
    // The answer that is about to go out to this reader has the correction of this snapshot.
    std::function<void(const published::Snapshot&, std::string_view reader)> serves{};
    std::function<modbus::RegisterImage::Results()> results{};  // in force
    std::function<void(const modbus::ControllerRequest&)>
        controller_request{};  // a request about a run or a result was committed
    std::function<bool(const modbus::ControllerRequest&)> may_request{};  // false refuses it. Null: all are allowed
    bool only_looks{};  // may write nothing but the word order of its own answers
  };
  struct Answer {
    enum class Kind { answered, refused, failed };  // failed: the library made none
    Kind kind{};
    std::span<const std::uint8_t> frame;  // with CRC, until the next request; empty: to a broadcast, which none answers
  };

  // unit: that of the requests. revision: of the firmware, for device identification.
  RegisterHandler(std::uint8_t unit, std::string revision, Callbacks callbacks);
  ~RegisterHandler();

  // reader: who asks, where several masters share the way.
  Answer answer(const modbus::Request& request, std::string_view reader = {});

  // Discards what a master that is gone was about to write.
  void restart() { writable_.restart(); }

 private:
  struct Library;

  Answer read(const modbus::Request& request, const published::Snapshot& snapshot, std::string_view reader);
  Answer write(const modbus::Request& request);
  Answer identify(const modbus::Request& request);
  Answer reply(const modbus::Request& request);
  Answer refuse(const modbus::Request& request, unsigned exception_code);

  const std::string revision_;
  const Callbacks callbacks_;
  std::unique_ptr<Library> library_;
  modbus::RegisterImage image_;
  modbus::WritableRegisters writable_;
};

}  // namespace probebox::app
