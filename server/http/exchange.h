#pragma once
#include <chrono>
#include <optional>
#include <string>

#include "server/access/key.h"
#include "server/access/rate_limiter.h"
#include "server/http/request_head.h"
#include "server/http/request_ids.h"

namespace penumbra::http {

/// One request and its answer, as the log and the metrics see them. Used by the thread of its connection alone.
struct Exchange {
  std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();
  std::string client;  // address
  std::string request_id;
  std::optional<TraceParent> trace;
  RequestHead head;
  std::string route = "none";
  access::Caller caller;
  std::optional<access::Rate> rate;
  std::string origin;        // an allowed one, where the request has it
  int status = 0;            // 0: nothing was answered
  bool is_admitted = false;  // all but the body is known to be well
  bool is_last = false;      // the connection ends with the answer
  std::uint64_t sent_bytes = 0;
};

}  // namespace penumbra::http
