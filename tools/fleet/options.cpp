#include "tools/fleet/options.hpp"

#include <CLI/CLI.hpp>

namespace probebox::fleet {

void declareOptions(CLI::App& command, Options& options) {
  command.name("probebox-fleet");
  command.description(
      "probebox-fleet: shows one box to Prometheus (GET /metrics) and publishes its state, results and history by "
      "MQTT. It only reads.");
  command.footer(
      "Example:\n  probebox-fleet -u tcp:127.0.0.1:7627 --listen 127.0.0.1:9627 --mqtt broker:8883 --ca ca.pem "
      "--certificate box.pem --key box.key --state /var/lib/probebox-fleet");
  command.set_version_flag("-V,--version", std::string{"probebox-fleet " PROBEBOX_VERSION} +
                                               (Broker::isBuilt() ? "" : ", built without MQTT"));
  command.add_option(
      "-u,--uri", options.uri,
      "the box: tcp:HOST:PORT, tls:HOST[:PORT], serial:DEVICE[,baud=N] or usb[:SERIAL]; default: PROBEBOX_URI, or the "
      "only box there is");
  command
      .add_option("--listen", options.listen,
                  "where /metrics is served; port 0 takes a free one; default: the socket that systemd passes")
      ->type_name("HOST:PORT");
  auto* mqtt =
      command.add_option("--mqtt", options.mqtt, "the broker; without it nothing is published")->type_name("HOST:PORT");
  command.add_option("--ca", options.ca, "certificates (PEM) that the broker's is signed by")
      ->type_name("FILE")
      ->needs(mqtt);
  command.add_option("--certificate", options.certificate, "this client's certificate (PEM)")
      ->type_name("FILE")
      ->needs(mqtt);
  command.add_option("--key", options.key, "its key (PEM)")->type_name("FILE")->needs(mqtt);
  auto* state =
      command.add_option("--state", options.state, "folder that remembers what the broker has")->type_name("FOLDER");
  mqtt->needs(state);
  command.add_option("--state-every", options.state_every_s, "seconds between two states")
      ->check(CLI::Range(1.0, 3600.0))
      ->type_name("SECONDS")
      ->capture_default_str()
      ->needs(mqtt);
}

Outcome<std::optional<BrokerOptions>> brokerOf(const Options& options) {
  if (options.mqtt.empty()) return std::optional<BrokerOptions>{};
  if (!Broker::isBuilt())
    return Error{
        "this program was built without MQTT: install libmosquitto-dev, configure and build again, or leave out "
        "--mqtt"};
  TRY(auto address, tcp::parseAddress(options.mqtt));
  const int files = !options.ca.empty() + !options.certificate.empty() + !options.key.empty();
  if (files != 0 && files != 3) return Error{"TLS needs all of --ca, --certificate and --key"};
  if (files == 0 && !tcp::isLoopback(address))
    return Error{"no TLS to " + options.mqtt +
                 ": name --ca, --certificate and --key; only a broker on this computer goes without"};
  return std::optional{BrokerOptions{std::move(address), options.ca, options.certificate, options.key}};
}

}  // namespace probebox::fleet
