// SPDX-License-Identifier: Apache-2.0
// Converts an OPC UA value for feed.sock (daemon/protocol/feed_line.hpp).
import { DataType } from "node-opcua-client";

const WIDE = new Set([DataType.Int64, DataType.UInt64]);
const NUMBERS = new Set([
  DataType.Boolean, DataType.SByte, DataType.Byte, DataType.Int16, DataType.UInt16, DataType.Int32, DataType.UInt32,
  DataType.Float, DataType.Double, ...WIDE,
]);
const SEVERITIES = ["good", "uncertain", "bad", "bad"]; // the two highest bits of a status code, OPC UA 10000-4, 7.39

const LONGEST_WORD = 64; // bytes

// A text is a word, such as AUTO. `why` is the error for a value that is neither a word nor a number.
function valueOf(variant) {
  const type = DataType[variant?.dataType] ?? "nothing";
  if (!variant || variant.arrayType !== 0) return { why: `is ${variant?.arrayType ? "an array" : "empty"}` };
  const text = variant.dataType === DataType.LocalizedText ? variant.value?.text : variant.value;
  if (typeof text === "string") {
    const word = text.length > 0 && Buffer.byteLength(text) <= LONGEST_WORD;
    return { one: text, why: word ? "" : "is a text of 0 or more than 64 bytes" };
  }
  if (!NUMBERS.has(variant.dataType)) return { why: `is of type ${type}, not a number` };
  let number = Number(variant.value);
  // Two words of 32 bits; the high one of a signed value arrives as unsigned.
  if (WIDE.has(variant.dataType)) {
    const [high, low] = variant.value;
    const whole = (BigInt(high >>> 0) << 32n) | BigInt(low >>> 0);
    number = Number(variant.dataType === DataType.Int64 ? BigInt.asIntN(64, whole) : whole);
  }
  return { one: number, why: Number.isFinite(number) ? "" : `is ${number}` };
}

// Returns seconds since 1970 from the source's stamp; null without a stamp.
function stampOf(value) {
  return value.sourceTimestamp ? value.sourceTimestamp.getTime() / 1000 + (value.sourcePicoseconds ?? 0) * 1e-12 : null;
}

// Returns {value, time, quality}, and `why` if quality is not good.
export function toFed(dataValue) {
  const quality = SEVERITIES[dataValue.statusCode.value >>> 30];
  const time = stampOf(dataValue);
  if (quality === "bad") return { value: null, time, quality, why: dataValue.statusCode.name };
  const { one, why } = valueOf(dataValue.value);
  if (why) return { value: null, time, quality: "bad", why };
  return { value: one, time, quality, why: quality === "good" ? "" : dataValue.statusCode.name };
}
