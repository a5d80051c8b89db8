// Counts the pixels that pixelmatch finds different: JSON with RGBA in base64 on stdin, counts on stdout.
import { readFileSync } from "node:fs";
import pixelmatch from "pixelmatch";

const { width, height, reference, candidates, thresholds } = JSON.parse(readFileSync(0, "utf8"));
const bytes = (text) => new Uint8Array(Buffer.from(text, "base64"));
const counts = candidates.map((candidate) =>
  thresholds.map((threshold) =>
    pixelmatch(bytes(reference), bytes(candidate), null, width, height, { threshold }),
  ),
);
process.stdout.write(JSON.stringify(counts));
