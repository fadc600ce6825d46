@provenance@
export type State = @states@;
export type Input = @inputs@;
export type Output = @outputs@;
export type Parameter = @parameters@;
export type Column = "time" | State | Input | Output@columns@;
/** All values in their order, or some by name; those that are not named keep their defaults. */
export type Values<Name extends string> = ArrayLike<number> | Partial<Record<Name, number>>;
/** Signals linear in time: end [s] of each segment, values at its start, slopes [1/s]. */
export interface Segments {
  ends: readonly number[];
  values: readonly (readonly number[])[];
  slopes: readonly (readonly number[])[];
}
export interface Changes {
  parameters?: Values<Parameter>;
  initial?: Values<State>;
  /** Start of the run [s]. */
  start?: number;
  segments?: Segments;
  /** Times of the rows [s], rising. */
  times?: ArrayLike<number>;
@changes@}
export interface Run {
  /** One array a column, in SI units. */
  columns: Record<Column, number[]>;
  /** 0: complete, 2: the step became too small, 3: a value is not finite, 5: an input is beyond its range. */
  status: number;
  /** Time reached [s]. */
  time: number;
  steps: number;
  rejected: number;
@results@}
export const states: readonly State[];
export const inputs: readonly Input[];
export const outputs: readonly Output[];
/** Unit of each state, input and output. */
export const units: Record<State | Input | Output, string>;
export const parameters: readonly Parameter[];
export const defaults: readonly number[];
/** Bounds of the parameters, which `simulate` checks; `prepare` takes any numbers. */
export const parameterMinimum: readonly number[];
export const parameterMaximum: readonly number[];
export const nominal: readonly number[];
export const inputMinimum: readonly number[];
export const inputMaximum: readonly number[];
export const status: {done: 0; stepTooSmall: 2; notFinite: 3; outOfRange: 5};
/** Run with these changes; without any that of the export. Throws RangeError for what it does not know. */
export function simulate(changes?: Changes): Run;
