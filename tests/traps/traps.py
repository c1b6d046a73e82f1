"""The traps of cpp-httplib, for tests/traps/run, which opens them, and tests/lint/run, which sees that they can be opened."""
from pathlib import Path

LISTENER, CONNECTION, HEAD = "server/http/listener.cpp", "server/http/connection.cpp", "server/http/request_head.cpp"
EVENTS, ACCEPTOR, DISPATCHER = "server/http/event_route.cpp", "server/http/acceptor.cpp", "server/http/dispatcher.cpp"
ENCODING = "server/http/encoding.cpp"

# The trap; what to take out, as (file, text, instead); the test that must fail.
TRAPS = [
    ("a backlog of 5", [(ACCEPTOR, "::listen(socket, backlog)", "::listen(socket, backlog > 0 ? 5 : 0)")],
     "system_test.System.test_a_burst_of_clients_is_let_in_at_once"),
    ("Nagle is on", [(ACCEPTOR, "::setsockopt(connection, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);", "static_cast<void>(yes);")], "accepted connections do not wait for acknowledgements"),
    ("no payload limit for chunked bodies", [(HEAD, "if (checked.fields[Field::transfer_encoding]) {", "if (false) {")],
     "requests that cannot be framed are refused at once"),
    ("compressed bodies inflate", [(ENCODING, "text.size() >= max_bytes", "false"), (ENCODING, "std::min(next_size, max_bytes)", "next_size")],
     "limits hold while a body is inflated"),
    ("answers are in parts", [(HEAD, 'return text + "\\r\\n";', 'return text + "Range: bytes=0-9\\r\\n\\r\\n";')], "no answer is in parts"),
    ("headers without bound",
     [(CONNECTION, "if (end <= limits_.max_head_bytes) {", "if (end != std::string::npos) {"),
      (CONNECTION, "if (unread_.size() > limits_.max_head_bytes) return", "if (false) return")], "header fields have a budget"),
    ("slow senders", [(CONNECTION, "Clock::now() + limits_.request;", "Clock::now() + std::chrono::hours(1);")],
     "slow senders are cut, wherever they stop"),
    ("long paths", [(HEAD, "if (target.substr(0, target.find('?')).size() > max_path_bytes) return api::uri_too_long(max_path_bytes);", "")],
     "the longest path and query are no trouble"),
    ("an unread body is the next request",
     [(LISTENER, " && connection.is_read()", ""), (DISPATCHER, "if (is_body_unread && ", "if (false && is_body_unread && ")],
     "a body that nobody reads is never taken for a request"),
    ("a POST without a length waits", [(DISPATCHER, "if (!fields[Field::content_length]) return api::length_required();", "")],
     "a POST without a length is answered at once, one with length 0 works"),
    ("ports are shared", [(ACCEPTOR, "SO_REUSEADDR, &yes", "SO_REUSEPORT, &yes")], "a port that is taken is an error"),
    ("exception text in a header",
     [(DISPATCHER, "    set_exception_handler([]", "    static_cast<void>([]")], "what a handler throws stays inside"),
    ("a thread for each stream", [(EVENTS, "taken_ >= limits_.all || own >= limits_.of_one_client", "own == SIZE_MAX")],
     "streams are limited, and closed ones make room"),
    ("dead clients", [(EVENTS, "if (!is_wanted_()) return false;", "static_cast<void>(is_wanted_);")], "the slot of a client that left is free soon"),
    ("stopping waits for connections",
     [(LISTENER, "if (::write(stop_descriptor_, &one, sizeof one) < 0)", "if (one == 0)")],
     "a signal ends the server cleanly while it renders, streams and waits"),
    ("descriptors leak", [(CONNECTION, "  ::close(socket_);", "")], "refused connections leave no descriptor open"),
]


def faults(root):
    """In words: what is to be taken out and does not stand exactly once in its file, and tests that are gone."""
    def text_of(file):
        path = Path(root) / file
        return path.read_text() if path.is_file() else ""

    tests = "".join(path.read_text() for folder in ("server", "serve") for path in Path(root, "tests", folder).iterdir() if path.is_file())
    counts = [(file, text, text_of(file).count(text)) for _, changes, _ in TRAPS for file, text, _ in changes]
    return [f"{file}: exactly one {text!r} belongs here, not {count} (tests/traps/traps.py)" for file, text, count in counts if count != 1] + [
        f"tests/traps/traps.py: there is no test {test!r}" for _, _, test in TRAPS if test.split(".")[-1] not in tests]
