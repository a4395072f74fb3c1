#include "firmware/app/cnc/register_handler.hpp"

#include <algorithm>
#include <array>
#include <fcntl.h>
#include <modbus/modbus.h>
#include <new>
#include <unistd.h>
#include <utility>

#include "drivers/io/descriptor.hpp"
#include "firmware/modbus/identification.hpp"

namespace probebox::app {
namespace {

constexpr int kMostReads = MODBUS_MAX_READ_REGISTERS;
constexpr int kMostWrites = MODBUS_MAX_WRITE_REGISTERS;
// Unit, function, two words and the CRC: all requests but those that write several registers.
constexpr std::size_t kShortRequest = 8;
constexpr std::size_t kBesideValues = 9;  // bytes of a request that writes several registers

// In any of its formats.
bool hasCorrection(std::size_t first, std::size_t count) {
  namespace address = modbus::address;
  constexpr std::size_t kTriple = 3, kTripleOfPairs = 6;
  const auto overlaps = [&](std::size_t at, std::size_t size) { return first < at + size && at < first + count; };
  return overlaps(address::correction_i16, kTriple) || overlaps(address::correction_offset, kTriple) ||
         overlaps(address::correction_f32, kTripleOfPairs) || overlaps(address::correction_i32, kTripleOfPairs);
}

}  // namespace

// libmodbus builds the answers; requests are found before it sees them. It writes into a pipe, so that the bytes of an
// answer are known to those who send them.
struct RegisterHandler::Library {
  struct FreeContext {
    void operator()(modbus_t* context) const { modbus_free(context); }
  };
  struct FreeMapping {
    void operator()(modbus_mapping_t* mapping) const { modbus_mapping_free(mapping); }
  };

  explicit Library(std::uint8_t unit)
      : context{modbus_new_rtu("/dev/null", 19200, 'N', 8, 1)},  // never opened
        mapping{modbus_mapping_new(0, 0, modbus::kRegisterCount, modbus::kRegisterCount)} {
    std::array<int, 2> ends{};
    if (!context || !mapping || pipe2(ends.data(), O_NONBLOCK | O_CLOEXEC) != 0) throw std::bad_alloc{};
    out = io::Descriptor{ends[0]};
    in = io::Descriptor{ends[1]};
    modbus_set_slave(context.get(), unit);
    modbus_set_socket(context.get(), in.get());
  }

  // built: what libmodbus returned about an answer, negative when it made none.
  Answer written(int built, Answer::Kind kind) {
    const auto size = ::read(out.get(), frame.data(), frame.size());
    return {built < 0 ? Answer::Kind::failed : kind,
            std::span{frame}.first(size > 0 ? static_cast<std::size_t>(size) : 0)};
  }

  io::Descriptor out;
  io::Descriptor in;
  std::array<std::uint8_t, modbus::kMaxFrameBytes> frame{};

  std::unique_ptr<modbus_t, FreeContext> context;
  std::unique_ptr<modbus_mapping_t, FreeMapping> mapping;
};

RegisterHandler::RegisterHandler(std::uint8_t unit, std::string revision, Callbacks callbacks)
    : revision_{std::move(revision)}, callbacks_{std::move(callbacks)}, library_{std::make_unique<Library>(unit)} {}

RegisterHandler::~RegisterHandler() = default;

RegisterHandler::Answer RegisterHandler::answer(const modbus::Request& request, std::string_view reader) {
  const Kept kept = callbacks_.kept();
  writable_.restore(kept.word_order, kept.inhibits);
  // Use one snapshot for image and line, because a newer one may be published at any time.
  const auto published = callbacks_.snapshot();
  const auto snapshot = callbacks_.shown_to ? callbacks_.shown_to(reader, published) : published;
  image_.fill(snapshot, callbacks_.line ? callbacks_.line(snapshot) : published::LineState{},
              callbacks_.results ? callbacks_.results() : nullptr, writable_.wordOrder());
  switch (request.function()) {
    case modbus::Function::read_holding:
    case modbus::Function::read_input:
      return read(request, snapshot, reader);
    case modbus::Function::write_one:
    case modbus::Function::write_many:
      return write(request);
    case modbus::Function::encapsulated:
      return identify(request);
  }
  return refuse(request, MODBUS_EXCEPTION_ILLEGAL_FUNCTION);
}

RegisterHandler::Answer RegisterHandler::read(const modbus::Request& request, const published::Snapshot& snapshot,
                                              std::string_view reader) {
  if (request.size != kShortRequest) return refuse(request, MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE);
  const int wanted = request.word(4);
  if (wanted < 1 || wanted > kMostReads) return refuse(request, MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE);
  if (request.address() + static_cast<std::size_t>(wanted) > modbus::kRegisterCount) {
    return refuse(request, MODBUS_EXCEPTION_ILLEGAL_DATA_ADDRESS);
  }
  if (callbacks_.serves && hasCorrection(request.address(), static_cast<std::size_t>(wanted)))
    callbacks_.serves(snapshot, reader);
  return reply(request);
}

RegisterHandler::Answer RegisterHandler::write(const modbus::Request& request) {
  std::array<std::uint16_t, kMostWrites> values{};
  std::size_t wanted = 1;
  std::size_t data_at = 4;
  if (request.function() == modbus::Function::write_many) {
    wanted = request.word(4);
    data_at = 7;
    if (wanted < 1 || wanted > values.size() || request.bytes[6] != 2 * wanted ||
        request.size != kBesideValues + 2 * wanted) {
      return refuse(request, MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE);
    }
  } else if (request.size != kShortRequest) {
    return refuse(request, MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE);
  }
  for (std::size_t i = 0; i < wanted; ++i) values[i] = request.word(data_at + 2 * i);

  if (callbacks_.only_looks && (request.address() != modbus::address::word_order || wanted > 1))
    return refuse(request, MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE);
  auto changed = writable_;
  const auto outcome = changed.write(request.address(), std::span{values}.first(wanted));
  if (!outcome) return refuse(request, static_cast<unsigned>(outcome.error().code));
  const bool requests = changed.controllerRequest().commit != writable_.controllerRequest().commit;
  if (requests && callbacks_.may_request && !callbacks_.may_request(changed.controllerRequest()))
    return refuse(request, MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE);
  const auto order = writable_.wordOrder();
  const bool reorders = changed.wordOrder() != order;
  if (reorders && !callbacks_.keep) return refuse(request, MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE);
  if (reorders && !callbacks_.keep(changed.wordOrder()))
    return refuse(request, MODBUS_EXCEPTION_SLAVE_OR_SERVER_FAILURE);
  // A request that the box refuses leaves no trace, so that it may be tried again.
  if (!outcome->empty() && !callbacks_.take(*outcome)) {
    if (reorders) callbacks_.keep(order);
    return refuse(request, MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE);
  }
  writable_ = changed;
  if (requests && callbacks_.controller_request) callbacks_.controller_request(writable_.controllerRequest());
  return reply(request);
}

RegisterHandler::Answer RegisterHandler::identify(const modbus::Request& request) {
  const auto size = modbus::identification(request, revision_, library_->frame);
  if (size == 0) return refuse(request, MODBUS_EXCEPTION_ILLEGAL_FUNCTION);
  const bool broadcast = request.unit() == MODBUS_BROADCAST_ADDRESS;
  return {Answer::Kind::answered, std::span{library_->frame}.first(broadcast ? 0 : size)};
}

RegisterHandler::Answer RegisterHandler::reply(const modbus::Request& request) {
  writable_.show(image_.registers());
  auto* mapping = library_->mapping.get();
  const auto registers = image_.registers();
  std::copy(registers.begin(), registers.end(), mapping->tab_registers);
  std::copy(registers.begin(), registers.end(), mapping->tab_input_registers);
  return library_->written(
      modbus_reply(library_->context.get(), request.bytes.data(), static_cast<int>(request.size), mapping),
      Answer::Kind::answered);
}

RegisterHandler::Answer RegisterHandler::refuse(const modbus::Request& request, unsigned exception_code) {
  if (request.unit() == MODBUS_BROADCAST_ADDRESS) return {Answer::Kind::refused, {}};
  return library_->written(modbus_reply_exception(library_->context.get(), request.bytes.data(), exception_code),
                           Answer::Kind::refused);
}

}  // namespace probebox::app
