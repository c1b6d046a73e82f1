#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/http/message.h"

namespace penumbra::http {

enum class Body { none, json };

struct Route {
  std::string method;
  std::string path;  // may hold one segment {id}
  Body body = Body::none;
  Handler handler;
  // Needed where keys are asked for. That a call is for everybody – nothing – has to be said.
  std::optional<access::Scope> scope = access::Scope::write;
  std::string name = {};                          // in metrics and logs; empty: the path
  bool takes_token = false;                       // also in the address, as access_token
  std::vector<std::string_view> parameters = {};  // of the query; others are refused
  bool takes_any_parameter = false;
};

/// Which handler answers which method and path. Filled first, then shared between threads.
class Router {
 public:
  void add(Route route) { routes_.push_back(std::move(route)); }
  const std::vector<Route>& routes() const { return routes_; }

  struct Match {
    const Route* route = nullptr;      // nothing: no such path, or not with this method
    std::string id;                    // of the path's {id}
    std::string name;                  // of the path's routes; empty: there is no such path
    std::vector<std::string> allowed;  // the methods of this path; empty: there is no such path
  };
  Match find(std::string_view method, std::string_view path) const;

 private:
  std::vector<Route> routes_;
};

}  // namespace penumbra::http
