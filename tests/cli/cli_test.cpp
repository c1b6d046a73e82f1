#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

using nlohmann::json;
namespace fs = std::filesystem;

namespace {

/// A folder of this test's own, gone with it.
class Folder {
 public:
  Folder() : path_(fs::temp_directory_path() / ("penumbra-cli-" + std::to_string(getpid()))) {
    fs::create_directories(path_);
  }
  ~Folder() { fs::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  std::string operator/(const std::string& name) const { return (path_ / name).string(); }
  std::string file(const std::string& name, const std::string& text) const {
    std::ofstream(path_ / name) << text;
    return *this / name;
  }

 private:
  fs::path path_;
};

std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream bytes;
  bytes << file.rdbuf();
  return bytes.str();
}

struct Run {
  int status;
  std::string out, err;
};

/// `penumbra` with these words of a shell, in this environment.
Run penumbra(const Folder& folder, const std::string& words, const std::string& environment = "") {
  const std::string out = folder / "stdout", err = folder / "stderr";
  const std::string line = environment + " " PENUMBRA_BIN_DIR "/penumbra " + words + " >" + out + " 2>" + err;
  const int status = std::system(line.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, bytes_of(out), bytes_of(err)};
}

const std::string job = R"({"scene": {
  "camera": {"position": [0, 0, 5], "direction": [0, 0, -1], "vertical_fov": 40},
  "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1}],
  "lights": [{"type": "point", "position": [3, 4, 5], "intensity": 1, "radius": 0.5}]},
  "options": {"width": 32, "height": 24}})";

bool is_png(const std::string& bytes) { return bytes.starts_with("\x89PNG"); }
bool is_exr(const std::string& bytes) { return bytes.starts_with("\x76\x2f\x31\x01"); }
/// From the header of a PNG.
int width_of(const std::string& png) {
  return 256 * static_cast<unsigned char>(png.at(18)) + static_cast<unsigned char>(png.at(19));
}

}  // namespace

TEST_CASE("version and help") {
  const Folder folder;
  const Run version = penumbra(folder, "--version");
  CHECK(version.status == 0);
  CHECK(version.out.starts_with("penumbra "));
  CHECK(penumbra(folder, "--help").status == 0);
  for (const std::string command : {"serve", "render", "worker", "validate"}) {
    const Run help = penumbra(folder, command + " --help");
    CHECK(help.status == 0);
    CHECK(help.out.find("Usage: penumbra " + command) != std::string::npos);
    std::istringstream lines(help.out);
    for (std::string line; std::getline(lines, line);) {
      const bool is_flag = line.starts_with("  -") && !line.starts_with("  -h,");
      CHECK_MESSAGE((!is_flag || line.find("(Env:PENUMBRA_") != std::string::npos), line);
    }
  }
}

TEST_CASE("arguments that cannot be used") {
  const Folder folder;
  const std::string file = folder.file("job.json", job);
  for (const std::string& words : {std::string(""),
                                   std::string("paint"),
                                   std::string("render"),
                                   "render " + file,
                                   std::string("render -o a.png"),
                                   "render " + file + " -o " + folder / "a.jpg",
                                   "render " + file + " -o " + folder / "no/folder/a.png",
                                   "render " + folder / "none.json -o " + folder / "a.png",
                                   "render " + file + " -o a.png --threads x",
                                   "render " + file + " -o a.png --without everything",
                                   std::string("validate"),
                                   "validate " + folder / "none.json",
                                   std::string("serve --listen nowhere"),
                                   std::string("serve --queue -1"),
                                   std::string("serve --log-level loud"),
                                   std::string("serve --keep-jobs-days nan"),
                                   std::string("serve --request-timeout nan"),
                                   std::string("serve --job-time-limit inf"),
                                   "validate --max-work nan " + file,
                                   std::string("worker --store postgresql://localhost")}) {
    const Run run = penumbra(folder, words);
    CHECK_MESSAGE(run.status == 2, words);
    CHECK_MESSAGE(!run.err.empty(), words);
    CHECK(run.out.empty());
  }
}

TEST_CASE("the user's own file may be larger than what a server takes, unless told otherwise") {
  const Folder folder;
  const std::string file = folder.file("large.json", job + std::string(9 << 20, ' '));
  CHECK(penumbra(folder, "validate " + file).status == 0);
  CHECK(penumbra(folder, "validate - <" + file).status == 0);
  CHECK(penumbra(folder, "render " + file + " -o " + folder / "large.png").status == 0);
  CHECK(penumbra(folder, "validate --max-body 8M " + file).status == 2);
  CHECK(penumbra(folder, "validate --max-body 10M " + file).status == 0);
}

TEST_CASE("validate prints the cost of a valid job and every error of another") {
  const Folder folder;
  const Run valid = penumbra(folder, "validate " + folder.file("job.json", job));
  CHECK(valid.status == 0);
  CHECK(json::parse(valid.out).at("cost").at("pixels") == 32 * 24);

  const std::string bad = folder.file("bad.json", R"({"scene": {"camera": 1, "x": 2}, "more": 3})");
  const Run listed = penumbra(folder, "validate " + bad);
  CHECK(listed.status == 2);
  std::istringstream lines(listed.out);
  std::vector<std::string> pointers;
  for (std::string line; std::getline(lines, line);) pointers.push_back(line.substr(0, line.find(':')));
  CHECK(json(pointers).dump() == R"(["/scene/camera","/scene/x","/more"])");

  // A name is anybody's: it makes no line and no colour of its own.
  const std::string rude = folder.file("rude.json", "{\"scene\": {\"a\\n\\u001b[31m\": 1}}");
  CHECK(penumbra(folder, "validate " + rude).out.find("/scene/a\\u000a\\u001b[31m: ") != std::string::npos);

  CHECK(penumbra(folder, "validate " + folder.file("text.json", "no JSON")).status == 2);
  CHECK(penumbra(folder, "validate --max-body 10 " + folder / "job.json").status == 2);
  CHECK(penumbra(folder, "validate " + folder / "job.json", "PENUMBRA_MAX_BODY=10").status == 2);
  CHECK(penumbra(folder, "validate - <" + folder / "job.json").status == 0);
}

TEST_CASE("render writes a PNG, the percentage and, when asked, the statistics") {
  const Folder folder;
  const std::string file = folder.file("job.json", job), image = folder / "a.png";
  const Run run = penumbra(folder, "render " + file + " -o " + image + " --stats -");
  CHECK(run.status == 0);
  CHECK(is_png(bytes_of(image)));
  CHECK(width_of(bytes_of(image)) == 32);
  CHECK(json::parse(run.out).at("rays").at("camera") == 32 * 24);
  CHECK(run.err.starts_with("0.0 %\n"));
  CHECK(run.err.ends_with("100.0 %\n"));

  const std::string stats = folder / "stats.json";
  const Run other = penumbra(folder, "render - -o " + image + " --stats " + stats + " <" + file);
  CHECK(other.status == 0);
  CHECK(other.out.empty());
  CHECK(json::parse(bytes_of(stats)).contains("encode_s"));
}

TEST_CASE("options are set by flags and by the environment") {
  const Folder folder;
  const std::string file = folder.file("job.json", job), image = folder / "a.png";
  const std::string render = "render " + file + " -o " + image;
  CHECK(penumbra(folder, render + " --set width=50 --set height=10").status == 0);
  CHECK(width_of(bytes_of(image)) == 50);
  CHECK(penumbra(folder, render, "PENUMBRA_SET='width=60 seed=3'").status == 0);
  CHECK(width_of(bytes_of(image)) == 60);
  const Run wrong = penumbra(folder, render + " --set width=0 --set colour=1");
  CHECK(wrong.status == 2);
  CHECK(wrong.err.find("/options/width: ") != std::string::npos);
  CHECK(wrong.err.find("/options/colour: ") != std::string::npos);
}

TEST_CASE("the format follows the name of the output and must not contradict it") {
  const Folder folder;
  const std::string file = folder.file("job.json", job), render = "render " + file + " -o ";
  CHECK(penumbra(folder, render + folder / "a.exr").status == 0);
  CHECK(is_exr(bytes_of(folder / "a.exr")));
  CHECK(penumbra(folder, render + folder / "b.EXR --set format=exr").status == 0);
  CHECK(penumbra(folder, render + folder / "c.png --set format=exr").status == 2);
  CHECK(penumbra(folder, render + folder / "d.exr --set format=png").status == 2);
  CHECK_FALSE(fs::exists(folder / "c.png"));
  CHECK_FALSE(fs::exists(folder / "d.exr"));
}

TEST_CASE("threads and switches change nothing in the image") {
  const Folder folder;
  const std::string render = "render " + folder.file("job.json", job) + " -o ";
  REQUIRE(penumbra(folder, render + folder / "a.png").status == 0);
  for (const std::string flags : {"--threads 0", "--threads 3", "--threads -2", "--without merge-lights",
                                  "--without light-cells", "--set threads=1"}) {
    REQUIRE(penumbra(folder, render + folder / "b.png " + flags).status == 0);
    CHECK_MESSAGE(bytes_of(folder / "a.png") == bytes_of(folder / "b.png"), flags);
  }
  CHECK(penumbra(folder, render + folder / "b.png --without merge-lights --without shadow-candidates").status == 0);
}

TEST_CASE("a signal cancels a render, which then leaves no image") {
  const Folder folder;
  const std::string file = folder.file("job.json", job), image = folder / "a.png";
  const std::string render =
      "render " + file + " -o " + image + " --set width=4000 --set height=4000 --set samples_per_pixel=512";
  for (const std::string signal : {"INT", "TERM"}) {
    // Until it has reported something the signal might come before anyone waits for it.
    const std::string line = "& p=$!; until [ -s " + folder / "stderr" + " ]; do sleep 0.01; done; kill -" + signal +
                             " $p; wait $p; exit $?";
    const std::string out = folder / "stdout", err = folder / "stderr";
    fs::remove(err);
    const std::string whole = PENUMBRA_BIN_DIR "/penumbra " + render + " >" + out + " 2>" + err + " " + line;
    const int status = std::system(whole.c_str());
    CHECK(WEXITSTATUS(status) == 1);
    CHECK(bytes_of(err).ends_with("canceled\n"));
    CHECK_FALSE(fs::exists(image));
  }
}

TEST_CASE("a file that cannot be written is a failure") {
  const Folder folder;
  const std::string file = folder.file("job.json", job);
  fs::create_directory(folder / "taken.png");
  CHECK(penumbra(folder, "render " + file + " -o " + folder / "taken.png").status == 1);
  const std::string to_a_full_disk = " >/dev/full 2>&1 || exit $?;";
  CHECK(penumbra(folder, "validate " + file + to_a_full_disk).status == 1);
  CHECK(penumbra(folder, "render " + file + " --stats - -o " + folder / "a.png" + to_a_full_disk).status == 1);
}

TEST_CASE("a PNG is written without OpenImageIO's module, an EXR is not") {
  const Folder folder;
  fs::create_directories(folder / "bin");
  fs::copy_file(PENUMBRA_BIN_DIR "/penumbra", folder / "bin/penumbra");
  const std::string words =
      (folder / "bin/penumbra") + " render " + folder.file("job.json", job) + " -o " + (folder / "image");
  CHECK(std::system((words + ".png 2>/dev/null").c_str()) == 0);
  CHECK(std::system((words + ".exr 2>/dev/null").c_str()) != 0);
}

TEST_CASE("render writes the image to standard output when told so, and nothing else") {
  const Folder folder;
  const std::string file = folder.file("job.json", job);
  REQUIRE(penumbra(folder, "render " + file + " --set width=40 --set height=30 -o " + folder / "a.png").status == 0);
  const Run run = penumbra(folder, "render " + file + " --set width=40 --set height=30 -o -");
  CHECK(run.status == 0);
  CHECK(run.out == bytes_of(folder / "a.png"));
  const Run exr = penumbra(folder, "render " + file + " --set width=40 --set height=30 --set format=exr -o -");
  CHECK(exr.out.starts_with("\x76\x2f\x31\x01"));
  CHECK(penumbra(folder, "render " + file + " -o - --stats -").status == 2);
  // Who reads no more ends it quietly.
  CHECK(penumbra(folder, "render " + file + " -o - | head -c 1 | wc -c").out == "1\n");
}

TEST_CASE("a command or flag that nobody knows is answered with the one that was probably meant") {
  const Folder folder;
  for (const auto& [words, meant] : std::vector<std::pair<std::string, std::string>>{
           {"rendr a.json -o a.png", "there is no command rendr; did you mean \"render\"?"},
           {"key creat", "there is no command creat; did you mean \"create\"?"},
           {"serve --max-bdoy=3", "there is no flag --max-bdoy; did you mean \"--max-body\"?"},
           {"render a.json --outptu a.png", "there is no flag --outptu; did you mean \"--output\"?"},
           {"zzz", "there is no command zzz\n"}}) {
    const Run run = penumbra(folder, words);
    CHECK(run.status == 2);
    CHECK_MESSAGE(run.err.find(meant) != std::string::npos, run.err);
  }
}

TEST_CASE("shells complete commands, flags and the values that a flag takes") {
  const Folder folder;
  const auto complete = [&](const std::string& words) {
    // What bash does at the last of the words.
    const std::string script = folder.file("complete.sh", "source <(" PENUMBRA_BIN_DIR
                                                          "/penumbra completion bash)\nCOMP_WORDS=(\"$@\")\n"
                                                          "COMP_CWORD=$(($# - 1))\n_penumbra\necho ${COMPREPLY[*]}\n");
    const std::string line = "bash " + script + " penumbra " + words + " >" + folder / "completed";
    CHECK(std::system(line.c_str()) == 0);
    return bytes_of(folder / "completed");
  };
  CHECK(complete("re") == "render\n");
  CHECK(complete("key ''") == "create list revoke\n");
  CHECK(complete("render a.json --out") == "--output\n");
  CHECK(complete("render --without mer") == "merge-lights\n");
  CHECK(complete("key create --scopes met") == "metrics\n");
  CHECK(complete("completion ''") == "bash zsh fish\n");
  CHECK(complete("render -o ''") == "\n");  // a file, as bash completes by itself
  for (const std::string shell : {"bash", "zsh", "fish"}) {
    CHECK(penumbra(folder, "completion " + shell + " >" + folder / "script" + "; ! command -v " + shell + " || " +
                               shell + " -n " + folder / "script")
              .status == 0);
  }
  CHECK(penumbra(folder, "completion tcsh").status == 2);
}
