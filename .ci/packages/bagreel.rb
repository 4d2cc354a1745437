# The Homebrew formula, for a tap or homebrew-core. `.ci/release` fills in version and checksum.
# Not tested with Homebrew itself; only the syntax was checked, and `cargo install` as below on Linux.
class Bagreel < Formula
  desc "See how a robot's software reconfigures during a mission, from its bag files"
  homepage "https://github.com/bagreel/bagreel"
  url "https://github.com/bagreel/bagreel/releases/download/v@VERSION@/bagreel-@VERSION@-source.tar.gz"
  sha256 "@SHA256:bagreel-@VERSION@-source.tar.gz@"
  license any_of: ["MIT", "Apache-2.0"]

  depends_on "rust" => :build

  def install
    system "cargo", "install", *std_cargo_args(features: "parquet")
    generate_completions_from_executable(bin/"bagreel", "completions")
    pages = Utils.safe_popen_read(bin/"bagreel", "man")
    (man1/"bagreel.1").write pages
    pages.scan(/^bagreel\\-(\w+)\(1\)$/).flatten.each do |name|
      (man1/"bagreel-#{name}.1").write Utils.safe_popen_read(bin/"bagreel", "man", name)
    end
    pkgshare.install "examples/courier.mcap"
  end

  test do
    system bin/"bagreel", "render", pkgshare/"courier.mcap", "-o", "courier.svg", "--period", "all"
    assert_match "<svg", (testpath/"courier.svg").read
  end
end
