#pragma once
#include <memory>
#include <optional>
#include <string>

#include "tools/probebox/view/box_connection.hpp"
#include "tools/probebox/view/cell_request_handler.hpp"

namespace probebox::view {

// Serves the page on 127.0.0.1 only, to browsers with the token, in threads of its own.
class Server {
 public:
  // All of them outlive the server.
  Server(BoxConnection& connection, const CellRequestHandler& cell, EventLog& events);
  ~Server();

  // port 0: a free one. Returns the address with the token, for a browser; nothing if the port is taken.
  std::optional<std::string> listen(unsigned port);

 private:
  struct Http;
  std::unique_ptr<Http> http_;
};

}  // namespace probebox::view
