#include <atomic>
#include <chrono>
#include <mosquitto.h>
#include <mutex>
#include <thread>
#include <utility>

#include "tools/fleet/broker.hpp"
#include "tools/fleet/queue/outbox.hpp"

namespace probebox::fleet {
namespace {

constexpr int kKeepAlive_s = 30;
constexpr int kLoop_ms = 200;
constexpr std::chrono::milliseconds kFirstPause{500}, kLongestPause{30'000};

// The library's own thread ends for good at some failures, such as a name that is not found or a certificate that has
// run out: this one tries again.
class MosquittoBroker : public Broker {
 public:
  MosquittoBroker() = default;
  MosquittoBroker(const MosquittoBroker&) = delete;
  MosquittoBroker& operator=(const MosquittoBroker&) = delete;

  ~MosquittoBroker() override {
    stops_ = true;
    if (client_ != nullptr) mosquitto_disconnect(client_);
    if (thread_.joinable()) thread_.join();
    mosquitto_destroy(client_);
    mosquitto_lib_cleanup();
  }

  // Why not; nothing when it has begun.
  std::optional<Error> begin(const BrokerOptions& options, const std::string& name, const Message& last_will) {
    mosquitto_lib_init();
    options_ = options;
    client_ = mosquitto_new(name.c_str(), true, this);
    if (client_ == nullptr) return Error{"MQTT: out of memory"};
    mosquitto_threaded_set(client_, true);
    mosquitto_max_inflight_messages_set(client_, Outbox::kMostInFlight);
    const auto will = mosquitto_will_set(client_, last_will.topic.c_str(), static_cast<int>(last_will.payload.size()),
                                         last_will.payload.data(), 0, true);
    if (will != MOSQ_ERR_SUCCESS) return Error{"MQTT: topic " + last_will.topic + ": " + mosquitto_strerror(will)};
    if (!options.ca.empty()) {
      const auto tls = mosquitto_tls_set(client_, options.ca.c_str(), nullptr, options.certificate.c_str(),
                                         options.key.c_str(), nullptr);
      if (tls != MOSQ_ERR_SUCCESS)
        return Error{"MQTT: " + options.ca + ", " + options.certificate + ", " + options.key + ": " +
                     mosquitto_strerror(tls) + "; they have to be PEM files that this user can read"};
    }
    mosquitto_connect_callback_set(client_, [](mosquitto*, void* self, int code) { of(self).onConnect(code); });
    mosquitto_disconnect_callback_set(client_, [](mosquitto*, void* self, int) { of(self).connected_ = false; });
    mosquitto_publish_callback_set(client_, [](mosquitto*, void* self, int message) { of(self).onPublish(message); });
    thread_ = std::thread{[this] { serve(); }};
    return std::nullopt;
  }

  bool connected() const override { return connected_; }
  unsigned connections() const override { return connections_; }
  std::string problem() const override {
    if (connected_) return {};
    const std::lock_guard lock{mutex_};
    return problem_;
  }
  void publishState(const Message& message) override {
    mosquitto_publish(client_, nullptr, message.topic.c_str(), static_cast<int>(message.payload.size()),
                      message.payload.data(), 0, true);
  }
  std::optional<int> publish(const Message& message) override {
    int number = 0;
    const auto result = mosquitto_publish(client_, &number, message.topic.c_str(),
                                          static_cast<int>(message.payload.size()), message.payload.data(), 1, false);
    // The library keeps one that found no connection, and sends it with the next.
    if (result == MOSQ_ERR_SUCCESS || result == MOSQ_ERR_NO_CONN || result == MOSQ_ERR_CONN_LOST) return number;
    return std::nullopt;
  }
  std::vector<int> acknowledged() override {
    const std::lock_guard lock{mutex_};
    return std::exchange(acknowledged_, {});
  }

 private:
  static MosquittoBroker& of(void* self) { return *static_cast<MosquittoBroker*>(self); }

  void onConnect(int code) {
    if (code != 0) return void(refused_ = mosquitto_connack_string(code));
    ++connections_;
    connected_ = true;
  }
  // Comes for messages of QoS 0 too, when they are sent: nobody waits for those.
  void onPublish(int message) {
    const std::lock_guard lock{mutex_};
    acknowledged_.push_back(message);
  }
  void setProblem(const std::string& what) {
    const std::lock_guard lock{mutex_};
    problem_ = what;
  }

  void serve() {
    const auto& address = options_.address;
    auto pause = kFirstPause;
    auto result = mosquitto_connect(client_, address.host.c_str(), address.port, kKeepAlive_s);
    while (!stops_) {
      while (result == MOSQ_ERR_SUCCESS && !stops_) {
        result = mosquitto_loop(client_, kLoop_ms, 1);
        if (connected_) pause = kFirstPause;
      }
      connected_ = false;
      if (stops_) return;
      // What the broker says tells more than that it has closed the connection.
      const auto refused = std::exchange(refused_, {});
      setProblem(tcp::describe(address) + ": " + (refused.empty() ? mosquitto_strerror(result) : refused));
      for (auto slept = pause; slept.count() > 0 && !stops_; slept -= kFirstPause)
        std::this_thread::sleep_for(kFirstPause);
      pause = std::min(2 * pause, kLongestPause);
      result = mosquitto_reconnect(client_);
    }
  }

  BrokerOptions options_;
  mosquitto* client_{};
  std::thread thread_;
  std::string refused_;  // by the broker; of that thread
  std::atomic<bool> stops_{}, connected_{};
  std::atomic<unsigned> connections_{};
  mutable std::mutex mutex_;
  std::vector<int> acknowledged_;
  std::string problem_;
};

}  // namespace

bool Broker::isBuilt() {
  return true;
}

Outcome<std::unique_ptr<Broker>> Broker::open(const BrokerOptions& options, const std::string& client,
                                              const Message& last_will) {
  auto broker = std::make_unique<MosquittoBroker>();
  if (auto error = broker->begin(options, client, last_will)) return std::move(*error);
  return std::unique_ptr<Broker>{std::move(broker)};
}

}  // namespace probebox::fleet
