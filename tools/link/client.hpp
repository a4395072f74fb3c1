#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/io/byte_pipe.hpp"
#include "protocol/messages/control.hpp"
#include "protocol/messages/handshake.hpp"
#include "protocol/messages/request.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/link/stream_reader.hpp"
#include "tools/link/wait.hpp"

namespace probebox::link {

// Describes a failure between this host and its box, with the remedy.
struct Failure {
  enum class Kind : std::uint8_t {
    link_lost,    // the connection is gone or the box is silent: reconnect
    timed_out,    // the Wait has ended
    box_refused,  // `code` and `what` come from the box
    no_protocol,  // the peer is no box, or one of an incompatible version
  };
  Kind kind{};
  messages::ErrorCode code{};
  std::string what{};
};

enum class LinkState : std::uint8_t { greeting, ready, lost };

struct ClientOptions {
  messages::BootId last_boot_id{};               // of the last connected box: allows resuming
  messages::TimeOfDay (*time_of_day)(){};        // for HELLO; null: it says none
  std::uint64_t window_bytes{1024 * 1024};       // of samples in flight
  Nanoseconds retry_period{500'000'000};         // HELLO, START, STOP and requests are sent again after this
  Nanoseconds sign_of_life_period{200'000'000};  // longest pause between frames to the box
  Nanoseconds silence{2'000'000'000};            // after so long without a frame of the box the link is lost
};

// Implements a host's end of one link. poll() never blocks; the calls that take a Wait repeat poll() until they are
// done or the Wait ends. A lost link stays lost: the caller reconnects.
class Client : private StreamListener {
 public:
  // `listener` receives all callbacks, may be null, and outlives the client.
  Client(io::Connection connection, ClientOptions options, StreamListener* listener = nullptr);

  Client(const Client&) = delete;  // the reader refers back to it
  Client& operator=(const Client&) = delete;

  LinkState poll(MonoTime now);
  LinkState state() const { return state_; }
  int descriptor() const { return connection_.data->descriptor(); }
  // True when the descriptor must be watched for writing as well.
  bool wantsToWrite() const { return connection_.data->watchedForWriting() && !data_out_.done(); }
  const StreamReader& reader() const { return reader_; }
  // The newest descriptor; empty before connect(). Unlike the reader's it outlasts a repeated WELCOME.
  const messages::Descriptor& described() const { return described_; }
  const std::optional<Failure>& failure() const { return failure_; }

  // Repeats HELLO until WELCOME, DESCRIPTOR and the test pattern have come.
  Outcome<messages::Welcome, Failure> connect(const Wait& wait);

  // Requests samples, which go to the listener. credit_bytes is set from the options.
  void start(messages::Start start);
  // Ends the samples; the closing ledger follows as a heartbeat with streaming 0.
  void stop();
  bool streaming() const { return wanted_.has_value(); }
  // After stop(): the closing ledger has come.
  bool closed() const { return !wanted_ && !box_streams_; }
  // Calls stop() and waits for the closing ledger.
  Outcome<Balance, Failure> finish(const Wait& wait);

  // Runs one operation of messages/control.hpp without waiting: ask(), then answered() until it returns something.
  template <class Operation>
  std::uint32_t ask(const typename Operation::Request& request) {
    return send(Operation::kOperation, messages::encoded(request));
  }
  template <class Operation>
  std::optional<Outcome<typename Operation::Answer, Failure>> answered(std::uint32_t id) {
    using Result = Outcome<typename Operation::Answer, Failure>;
    if (state_ == LinkState::lost) return Result{*failure_};
    auto answer = takeAnswer(id);
    if (!answer) return std::nullopt;
    if (answer->code != messages::ErrorCode::ok) {
      return Result{Failure{Failure::Kind::box_refused, answer->code, std::move(answer->text)}};
    }
    auto body = messages::decode<typename Operation::Answer>(answer->body);
    if (!body)
      return Result{
          Failure{Failure::Kind::no_protocol, {}, "the box's answer is cut off; update the older of the two"}};
    return Result{std::move(*body)};
  }
  // Drops a request whose answer is not needed any more.
  void forget(std::uint32_t id) { requests_.erase(id); }

  // The same, and waits for the answer.
  template <class Operation>
  Outcome<typename Operation::Answer, Failure> request(const typename Operation::Request& request, const Wait& wait) {
    const auto id = ask<Operation>(request);
    while (true) {
      if (auto answer = answered<Operation>(id)) return std::move(*answer);
      if (!round(wait)) break;
    }
    forget(id);
    return Failure{Failure::Kind::timed_out, {}, "the box did not answer in time"};
  }

  // Waits, then polls once; false when the Wait has ended.
  bool round(const Wait& wait);

 private:
  // Bytes that wait to be sent on one lane.
  struct Outgoing {
    std::vector<std::byte> bytes;
    std::size_t written{};
    std::uint32_t sequence{};
    bool done() const { return written == bytes.size(); }
  };
  struct Asked {
    std::vector<std::byte> payload;  // of the REQUEST
    MonoTime last_sent{};
    std::optional<messages::Answer> answer;
  };

  void onFrame(const frame::Frame& frame) override;
  bool needsBlocksThatStandAlone() const override;
  void onWelcome(const messages::Welcome& welcome) override;
  void onDescriptor(const messages::Descriptor& descriptor) override;
  void onTestPattern(bool as_expected) override;
  void onBlock(const DecodedBlock& block) override;
  void onGap(const messages::Gap& gap) override;
  void onHole(const messages::Gap& hole) override;
  void onKeyMissing() override;
  void onTrigger(const messages::Trigger& trigger) override;
  void onTriggerGap(const messages::TriggerGap& gap) override;
  void onTriggerHole(const messages::TriggerGap& hole) override;
  void onHeartbeat(const messages::Heartbeat& beat, const std::optional<Balance>& balance) override;
  void onRefusal(const messages::Refusal& refusal) override;
  void onAnswer(const messages::Answer& answer) override;

  std::uint32_t send(messages::Operation operation, std::vector<std::byte> body);
  std::optional<messages::Answer> takeAnswer(std::uint32_t id);
  frame::Framing framing() const { return connection_.control ? frame::Framing::bare : frame::Framing::delimited; }
  template <class Take>
  bool receive(io::BytePipe& pipe, Take take);
  void receiveAll();
  void transmit(io::BytePipe& pipe, Outgoing& out);
  void duties();
  void lose(Failure failure);
  void sendHello();
  void sendStart();
  void sendStop();
  void sendCredit();
  void frameUp(messages::MessageType type, std::span<const std::byte> payload);
  template <class Message>
  void sendMessage(const Message& message);

  io::Connection connection_;
  ClientOptions options_;
  StreamListener* listener_;
  StreamReader reader_;
  LinkState state_{LinkState::greeting};
  std::optional<Failure> failure_;
  messages::Descriptor described_;
  Outgoing data_out_;
  Outgoing control_out_;
  std::uint32_t last_id_{};
  std::map<std::uint32_t, Asked> requests_;
  std::optional<messages::Start> wanted_;
  bool box_streams_{};              // according to the last heartbeat
  std::uint64_t received_bytes_{};  // since START
  std::uint64_t credited_bytes_{};
  std::optional<MonoTime> began_{};
  MonoTime now_{};
  MonoTime last_heard_{};
  MonoTime last_hello_{};
  MonoTime last_sent_{};
  MonoTime last_stream_command_{};
};

}  // namespace probebox::link
