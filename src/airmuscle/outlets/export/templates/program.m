function model = @file@()
@provenance@%
% model = @file@() describes the system: names, units and defaults of its arrays, and its functions
%   c = model.prepare(p)          what the functions need of the parameters p, which only simulate checks
%   f = model.rates(x, u, c)      rates of the states x under the inputs u
%   o = model.outputs(x, u, c)    outputs
%   r = model.simulate(changes)   a run: columns r.data with the names r.names, r.status (0: complete), r.steps
% changes may have the fields parameters, initial, start, ends, values, slopes and times; the others are those of the
% exported run, model.run.
@loop_help@@constants@  model.prepare = @prepare;
  model.rates = @rhs;
  model.outputs = @outputs;
  model.simulate = @(varargin) simulate(model, varargin{:});
end

@simulate@function run = changed(run, changes)
  given = fieldnames(changes);
  for k = 1:numel(given)
    run.(given{k}) = changes.(given{k});
  end
end

function s = begin_run(model, run)
  check_parameters(run.parameters, model.parameters, model.parameter_minimum, model.parameter_maximum);
  s.c = prepare(run.parameters);
  s.n = numel(model.states);
  s.nominal = model.nominal;
  s.input_minimum = model.input_minimum(:);
  s.input_maximum = model.input_maximum(:);
  s.t = run.start;
  s.t_before = run.start;
  s.x = run.initial(:);
  s.x_before = s.x;
  s.h_taken = 0;
  s.d2 = zeros(s.n, 1);
  s.d3 = zeros(s.n, 1);
@solver_constants@  s.steps = 0;
  s.rejected = 0;
end

function s = begin_segment(s, finish, u, w)
  s.start = s.t;
  s.finish = finish;
  s.u = u;
  s.w = w;
  s.moving = any(w);
  s.done = 0;
  last = u;
  last(w ~= 0) = u(w ~= 0) + (finish - s.start) * w(w ~= 0);
  s.refusal = input_refusal(s, u, last);
  s.h = @first_step@;
end

% Why inputs cannot go from `first` to `last`: 3 where one is not finite, 5 where one is beyond its range, which the
% rounding of a ramp may pass by 1e-9 of its size.
function refusal = input_refusal(s, first, last)
  slack = 1e-9 * max(abs(first), abs(last));
  refusal = 0;
  if ~all(isfinite([first; last]))
    refusal = 3;
  elseif any(min(first, last) < s.input_minimum - slack) || any(max(first, last) > s.input_maximum + slack)
    refusal = 5;
  end
end

function r = ended(r, s, status)
  r.status = status;
  r.time = s.t;
  r.steps = s.steps;
  r.rejected = s.rejected;
end

function u = inputs_at(s, time)
  u = s.u + (time - s.start) * s.w;
end

@check_parameters@
% Solver
@solver@
% Printed functions: J the distinct non-zeros of df/dx, A the LU factors of d I - J
@functions@
